"""What a worker process does. Loaded once in the fork server, so that a fresh worker starts warm.

Every job gets a process of its own: OMPL's random numbers are seeded once for a process, so only a
fresh one repeats an answer. Functions here take and return plain data that crosses a process
border cheaply; a refusal is returned and not raised, so that it arrives without a traceback.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from planner.errors import InputError
from planner.power.catalogue import list_effects
from planner.power.vehicle import list_vehicles
from planner.search.front import energy_time_front
from planner.search.matrix import energy_matrix
from planner.search.plan import plan_route, warm_up
from planner.search.reach import reachable_area
from planner.search.request import FrontRequest, MatrixRequest, PlanRequest, ReachRequest
from planner.search.situation import KINDS
from planner.terrain.catalogue import list_maps
from service.documents import finite, route_text, strict
from service.jobs.relief import relief_of
from service.jobs.telemetry import (
    adopt_effects,
    check_log,
    check_model,
    compare_log,
    diagnose_log,
    revert_model,
)

__all__ = [
    "adopt_effects",
    "catalogues",
    "check_log",
    "check_model",
    "compare_log",
    "diagnose_log",
    "front",
    "matrix",
    "reach",
    "relief",
    "revert_model",
    "solve",
]

warm_up()


@dataclass(frozen=True)
class Catalogues:
    """What is installed: lists of objects that have a ``name``."""

    maps: list[dict[str, Any]]
    vehicles: list[dict[str, Any]]
    effects: list[dict[str, Any]]
    kinds: tuple[str, ...]


def catalogues() -> Catalogues:
    """Lists of what is installed, ready for JSON."""
    return Catalogues(
        finite(list_maps()), finite(list_vehicles()), finite(list_effects()), tuple(KINDS)
    )


def solve(request: PlanRequest) -> str | InputError:
    """ROUTE.json of a request, or why the request cannot be used."""
    try:
        return route_text(plan_route(request).to_json())
    except InputError as error:
        return error


def matrix(request: MatrixRequest) -> str | InputError:
    """Energies between places as JSON, or why the request cannot be used."""
    try:
        return strict(energy_matrix(request).to_json())
    except InputError as error:
        return error


def reach(request: ReachRequest) -> str | InputError:
    """The reachable area as JSON, or why the request cannot be used."""
    try:
        return strict(reachable_area(request).to_json())
    except InputError as error:
        return error


def front(request: FrontRequest) -> str | InputError:
    """The front of duration against energy as JSON, or why the request cannot be used."""
    try:
        return strict(energy_time_front(request).to_json())
    except InputError as error:
        return error


def relief(name: str, most: int) -> str | InputError:
    """Heights of a map for a picture, as JSON; see service.jobs.relief."""
    try:
        return strict(relief_of(name, most))
    except InputError as error:
        return error
