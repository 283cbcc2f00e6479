"""The web application: endpoints, errors, headers, and workers that live as long as it does.

    app = create_app(Settings())

It never loads the planner itself; everything that plans or reads a map runs in worker processes.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from importlib.metadata import version
from typing import Any

from fastapi import Depends, FastAPI
from pydantic.json_schema import models_json_schema
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from planner.search.requests import FrontRequest, MatrixRequest, PlanRequest, ReachRequest
from service.http import error_handlers, keys
from service.http.endpoints import catalogues, health, jobs, logs, models, page, planning, workbench
from service.http.keys import KeyGuard
from service.http.patience import BodyDeadline
from service.http.requests import AdoptRequest, CompareRequest, DiagnoseRequest, RevertRequest
from service.http.state import Service
from service.jobs import Names, Runner, WorkerPool, Workers
from service.settings import Settings
from service.store import Store

_DESCRIPTION = """
Lowest-energy routes on real terrain, with the energy by physical effect.
All quantities are in SI units, positions in metres in the map's frame, angles in rad.
Every error is an RFC 9457 problem document.
""".strip()
# The page runs its own modules only: nothing inline, nothing evaluated, nothing from elsewhere.
_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
_REQUESTS = (
    *(PlanRequest, MatrixRequest, ReachRequest, FrontRequest),
    *(CompareRequest, DiagnoseRequest, AdoptRequest, RevertRequest),
)


class _SafeHeaders:
    """Adds the headers above to every response."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(_HEADERS)
            await send(message)

        await self.app(scope, receive, send_with_headers)


@asynccontextmanager
async def _running(
    settings: Settings, workers: Workers | None, job_workers: Workers | None
) -> AsyncIterator[Service]:
    """Store, workers and jobs, as long as the application lives."""
    async with AsyncExitStack() as stack:
        store = await asyncio.to_thread(Store.open, settings)
        stack.push_async_callback(asyncio.to_thread, store.close)
        data = () if settings.data_dir is None else (settings.data_dir.resolve(),)
        folders = (*data, store.files.folder)
        pool = workers or WorkerPool(
            workers=settings.workers,
            queue=settings.queue,
            time_limit_s=settings.time_limit_s,
            memory_limit_mb=settings.memory_limit_mb,
            keep_mb=settings.worker_memory_mb,
            keep_s=settings.worker_age_s,
            folders=folders,
        )
        job_pool = job_workers or WorkerPool(
            workers=settings.job_workers,
            queue=settings.job_workers,
            time_limit_s=settings.job_time_limit_s,
            memory_limit_mb=settings.memory_limit_mb,
            # Jobs are long and their logs large: nothing is worth keeping.
            keep_s=0.0,
            folders=folders,
            advice="send a shorter log, or raise JOULEPATH_JOB_TIME_LIMIT_S",
        )
        for processes in (pool, job_pool):
            stack.push_async_callback(processes.stop)
            await processes.start()
        # The first job waits until a worker has everything loaded, however busy the machine is.
        known = await pool.run("catalogues", limited=False)
        catalogue = {
            "map": [entry["name"] for entry in known.maps],
            "vehicle": [entry["name"] for entry in known.vehicles],
            "model": known.kinds,
        }
        names = Names(catalogue, settings.data_dir, store.model_file)
        slots, queue = settings.job_workers, settings.job_queue
        runner = Runner(store, job_pool, names, slots=slots, queue=queue)
        stack.push_async_callback(runner.stop)
        await runner.start()
        yield Service(settings, pool, known, names, store, runner)


def create_app(
    settings: Settings | None = None,
    workers: Workers | None = None,
    job_workers: Workers | None = None,
) -> FastAPI:
    """The application.

    Args:
        settings: from the environment when left out.
        workers: where requests are carried out; a pool of processes when left out.
        job_workers: where jobs are; ``workers``, or a pool of their own, when left out.
    """
    settings = settings or Settings()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with _running(settings, workers, job_workers or workers) as service:
            app.state.service = service
            yield

    app = FastAPI(
        title="joulepath",
        version=version("joulepath"),
        description=_DESCRIPTION,
        lifespan=lifespan,
        generate_unique_id_function=lambda route: route.name,
        # Their pages load scripts from elsewhere.
        docs_url=None,
        redoc_url=None,
    )
    error_handlers.install(app)
    for module in (planning, logs, workbench, jobs, models, catalogues, health):
        app.include_router(module.router, dependencies=[Depends(error_handlers.known_parameters)])
    app.include_router(keys.router)
    page.install(app)
    if settings.keys:
        app.add_middleware(KeyGuard, keys=settings.keys)
    app.add_middleware(BodyDeadline)
    app.add_middleware(_SafeHeaders)
    _describe(app)
    return app


def _describe(app: FastAPI) -> None:
    """Add the requests to the OpenAPI document, since endpoints read their own bodies."""

    build = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            _, requests = models_json_schema(
                [(model, "validation") for model in _REQUESTS],
                ref_template="#/components/schemas/{model}",
            )
            build()["components"]["schemas"] |= requests["$defs"]
        return build()

    app.openapi = openapi  # type: ignore[method-assign]
