"""The web application: endpoints, errors, headers, and workers that live as long as it does.

    app = create_app(Settings())

It never loads the planner itself; everything that plans or reads a map runs in worker processes.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from planner.search.request import PlanRequest
from service import problems
from service.jobs.pool import WorkerPool, Workers
from service.names import Names
from service.routes import catalogues, health, page, plan
from service.settings import Settings
from service.state import Service

# The page runs its own modules only: nothing inline, nothing evaluated, nothing from elsewhere.
_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}


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


def create_app(settings: Settings | None = None, workers: Workers | None = None) -> FastAPI:
    """The application.

    Args:
        settings: from the environment when left out.
        workers: where requests are carried out; a pool of processes when left out.
    """
    settings = settings or Settings()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        pool = workers or WorkerPool(
            workers=settings.workers,
            queue=settings.queue,
            time_limit_s=settings.time_limit_s,
            memory_limit_mb=settings.memory_limit_mb,
        )
        await pool.start()
        try:
            # The first job waits until a worker has everything loaded: ready means ready.
            known = await pool.run("catalogues")
            app.state.service = Service(
                settings=settings,
                workers=pool,
                catalogues={
                    "maps": known.maps,
                    "vehicles": known.vehicles,
                    "effects": known.effects,
                },
                names=Names(
                    catalogue={
                        "map": [entry["name"] for entry in known.maps],
                        "vehicle": [entry["name"] for entry in known.vehicles],
                        "model": known.kinds,
                    },
                    folder=settings.data_dir,
                ),
            )
            yield
        finally:
            await pool.stop()

    app = FastAPI(
        title="joulepath",
        version=version("joulepath"),
        description="Lowest-energy routes on real terrain, with the energy accounted for by "
        "physical effect. Metres in a map's frame, rad, SI throughout; every error is an "
        "RFC 9457 problem document.",
        lifespan=lifespan,
        # Their pages load scripts from elsewhere.
        docs_url=None,
        redoc_url=None,
    )
    problems.install(app)
    for module in (plan, catalogues, health):
        app.include_router(module.router)
    page.install(app)
    app.add_middleware(_SafeHeaders)
    _describe(app)
    return app


def _describe(app: FastAPI) -> None:
    """Put the request, which the endpoint reads by itself, into the OpenAPI document."""

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            document = get_openapi(
                title=app.title,
                version=app.version,
                description=app.description,
                routes=app.routes,
            )
            _, request = models_json_schema(
                [(PlanRequest, "validation")], ref_template="#/components/schemas/{model}"
            )
            document["components"]["schemas"] |= request["$defs"]
            app.openapi_schema = document
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]
