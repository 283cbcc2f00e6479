FROM python:3.11-slim AS build
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
WORKDIR /src
COPY requirements/lock.txt requirements/build.txt requirements/
RUN python -m venv /opt/joulepath \
 && /opt/joulepath/bin/pip install --require-hashes -r requirements/lock.txt \
 && pip install --require-hashes -r requirements/build.txt
COPY pyproject.toml README.md LICENSE ./
COPY planner planner
COPY service service
COPY maps maps
RUN pip wheel --no-deps --no-build-isolation --wheel-dir /tmp/wheel . \
 && /opt/joulepath/bin/pip install --no-deps /tmp/wheel/*.whl

FROM python:3.11-slim
# Compiled kernels are kept where the user may write.
ENV PATH=/opt/joulepath/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    JOULEPATH_CACHE_DIR=/var/cache/joulepath \
    JOULEPATH_DATA_DIR=/data \
    JOULEPATH_STORE_DIR=/var/lib/joulepath
# rasterio's wheel expects the system's expat. Any version that the base image offers will do.
# hadolint ignore=DL3008
RUN apt-get update \
 && apt-get install --yes --no-install-recommends libexpat1 \
 && rm -rf /var/lib/apt/lists/*
RUN useradd --system --uid 10001 --no-create-home joulepath \
 && mkdir -p /var/cache/joulepath /var/lib/joulepath /data \
 && chown joulepath /var/cache/joulepath /var/lib/joulepath
COPY --from=build /opt/joulepath /opt/joulepath
USER 10001
# Compile now what every worker needs, so that the container starts warm.
RUN python -m service.compiling
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=60s \
    CMD ["python", "-c", "import urllib.request as u; u.urlopen('http://127.0.0.1:8000/healthz', timeout=4)"]
CMD ["joulepath", "serve", "--host", "0.0.0.0", "--port", "8000"]
