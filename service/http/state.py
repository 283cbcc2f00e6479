"""What the endpoints share, and how they ask for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, cast

from fastapi import Depends, Request

from service.jobs import Catalogues, Names, Runner, Workers
from service.settings import Settings
from service.store import Store


@dataclass(frozen=True)
class Service:
    """A running service.

    Attributes:
        settings: how it runs.
        workers: where requests are carried out.
        catalogues: what is installed, ready for JSON.
        names: what requests may name.
        store: logs, versions of models, jobs.
        jobs: runs what takes long.
    """

    settings: Settings
    workers: Workers
    catalogues: Catalogues
    names: Names
    store: Store
    jobs: Runner


def _service(request: Request) -> Service:
    return cast(Service, request.app.state.service)


Running = Annotated[Service, Depends(_service)]
