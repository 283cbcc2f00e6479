"""What a worker process does. Loaded once in the fork server, so that a fresh worker starts warm.

Every job gets a process of its own: OMPL's random numbers are seeded once for a process, so only a
fresh one repeats an answer. Functions here take and return plain data that crosses a process
border cheaply; a refusal is returned and not raised, so that it arrives without a traceback.
"""

from __future__ import annotations

import resource
import signal
from dataclasses import dataclass
from typing import Any

from planner.terrain.catalogue import list_maps

from planner.errors import InputError
from planner.power.catalogue import list_effects
from planner.power.vehicle import list_vehicles
from planner.search.plan import KINDS, plan_route, warm_up
from planner.search.request import PlanRequest
from service.documents import finite, strict
from service.jobs.relief import relief_of

warm_up()


@dataclass(frozen=True)
class Catalogues:
    """What is installed: lists of objects that have a ``name``."""

    maps: list[dict[str, Any]]
    vehicles: list[dict[str, Any]]
    effects: list[dict[str, Any]]
    kinds: tuple[str, ...]


def settle_in(memory_limit_mb: int) -> None:
    """Prepare a new process: bounded memory, and Ctrl-C is for the service to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = memory_limit_mb * 1024 * 1024
    resource.setrlimit(
        resource.RLIMIT_AS, (wanted if most == resource.RLIM_INFINITY else min(wanted, most), most)
    )


def catalogues() -> Catalogues:
    """Lists of what is installed, ready for JSON."""
    return Catalogues(
        finite(list_maps()), finite(list_vehicles()), finite(list_effects()), tuple(KINDS)
    )


def solve(request: PlanRequest) -> str | InputError:
    """ROUTE.json of a request, or why the request cannot be used."""
    try:
        return strict(plan_route(request).to_json())
    except InputError as error:
        return error


def relief(name: str, most: int) -> str | InputError:
    """Heights of a map for a picture, as JSON; see service.jobs.relief."""
    try:
        return strict(relief_of(name, most))
    except InputError as error:
        return error
