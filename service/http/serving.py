"""Run the service under uvicorn, with one log line for each event."""

from __future__ import annotations

import logging
import sys

import structlog
import uvicorn

from service.http.app import create_app
from service.http.keys import check_address
from service.settings import Settings
from service.store import Store


def serve(*, host: str | None = None, port: int | None = None) -> None:
    """Serve until interrupted; arguments go before the environment's settings.

    Raises:
        InputError: others could ask without a key; the store's folder or its database cannot be
            used.
    """
    settings = Settings()
    host = host or settings.host
    check_address(host, settings)
    # Fails here with one sentence instead of during the start of the server.
    Store.open(settings).close()
    level = logging.getLevelNamesMapping()[settings.log_level.upper()]
    structlog.configure(
        wrapper_class=structlog.make_filtering_bound_logger(level),
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.format_exc_info,
            structlog.processors.JSONRenderer(),
        ],
        logger_factory=structlog.PrintLoggerFactory(sys.stderr),
    )
    uvicorn.run(
        create_app(settings),
        host=host,
        port=settings.port if port is None else port,
        log_level=settings.log_level,
        server_header=False,
    )
