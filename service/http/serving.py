"""Run the service under uvicorn, with one log line for each event."""

from __future__ import annotations

import errno
import logging
import socket
import sys

import structlog
import uvicorn

from planner.errors import InputError
from service.http.app import create_app
from service.http.keys import check_address
from service.http.patience import PatientProtocol
from service.settings import read_settings
from service.store import Store


def serve(*, host: str | None = None, port: int | None = None) -> None:
    """Serve until interrupted; arguments go before the environment's settings.

    Raises:
        InputError: a setting cannot be used; nothing can listen there; others could ask without a
            key; the store's folder or its database cannot be used.
    """
    settings = read_settings()
    host = host or settings.host
    port = settings.port if port is None else port
    check_free(host, port)
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
        port=port,
        log_level=settings.log_level,
        server_header=False,
        http=PatientProtocol,
    )


def check_free(host: str, port: int) -> None:
    """Try to listen, before the server does and fails with a traceback.

    Raises:
        InputError: the host is not known or not this machine's, or the port is taken.
    """
    accepted = "a name or an address of this machine, such as 127.0.0.1 or 0.0.0.0"
    try:
        kind, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        raise InputError("host", "is not known", value=host, accepted=accepted) from None
    with socket.socket(kind, socket.SOCK_STREAM) as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind(address)
        except OSError as error:
            if error.errno == errno.EADDRNOTAVAIL:
                problem = "is no address of this machine"
                raise InputError("host", problem, value=host, accepted=accepted) from None
            problem = f"cannot be listened on: {error.strerror}"
            raise InputError("port", problem, value=port, accepted="a free port, or 0") from None
