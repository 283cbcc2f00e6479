"""What a worker process does. Loaded once in the fork server, so that a fresh worker starts warm.

Every job gets a process of its own: OMPL's random numbers are seeded once for a process, so only a
fresh one repeats an answer. Functions here take and return plain data that crosses a process
border cheaply; a refusal is returned and not raised, so that it arrives without a traceback. What
answers a question has the name of the planner's function that it calls.
"""

from __future__ import annotations

import planner

# Loaded with the fork server, so that a fresh worker has it.
import planner.search.front
import planner.search.matrix
import planner.search.reach
from planner.errors import InputError
from planner.power.catalogue import list_effects
from planner.power.vehicles import list_vehicles
from planner.report.routes import answer_view
from planner.search.plan import warm_up
from planner.search.requests import FrontRequest, MatrixRequest, PlanRequest, ReachRequest
from planner.search.situation import KINDS
from planner.terrain.catalogue import list_maps
from service.documents import finite, route_text, strict
from service.jobs.outcomes import Catalogues
from service.jobs.process import waited_s
from service.jobs.relief import relief_of
from service.jobs.telemetry import (
    adopt,
    check,
    check_model,
    compare,
    diagnose,
    model_report,
    revert,
)

__all__ = [
    "adopt",
    "catalogues",
    "check",
    "check_model",
    "compare",
    "diagnose",
    "energy_matrix",
    "energy_time_front",
    "model_report",
    "plan_route",
    "reachable_area",
    "relief",
    "revert",
]

LEAST_BUDGET_S = 1e-3
"""What is left of a time budget, s, when all of it was spent waiting: the grid still answers."""

warm_up()


def catalogues() -> Catalogues:
    """Lists of what is installed, ready for JSON."""
    return Catalogues(
        finite(list_maps()), finite(list_vehicles()), finite(list_effects()), tuple(KINDS)
    )


def plan_route(request: PlanRequest, report: bool = False) -> str | InputError:
    """ROUTE.json of a request, or why the request cannot be used.

    Seconds that it was given to search count from its arrival. With ``report`` it has the answer's
    pictures and tables too, as HTML, with all of the map.
    """
    try:
        answer = planner.plan_route(less_waiting(request, waited_s()))
    except InputError as error:
        return error
    view = answer_view(answer, window=answer.terrain.extent) if report else None
    more = {} if view is None else {"report": "".join(view.sections)}
    return route_text({**answer.to_json(), **more})


def less_waiting(request: PlanRequest, waited_s: float) -> PlanRequest:
    """The request with what it waited taken off its time budget, if it came with one."""
    if "time_budget_s" not in request.model_fields_set:
        return request
    left = max(request.time_budget_s - waited_s, LEAST_BUDGET_S)
    return request.model_copy(update={"time_budget_s": left})


def energy_matrix(request: MatrixRequest) -> str | InputError:
    """Energies between places as JSON, or why the request cannot be used."""
    try:
        return strict(planner.energy_matrix(request).to_json())
    except InputError as error:
        return error


def reachable_area(request: ReachRequest) -> str | InputError:
    """The reachable area as JSON, or why the request cannot be used."""
    try:
        return strict(planner.reachable_area(request).to_json())
    except InputError as error:
        return error


def energy_time_front(request: FrontRequest) -> str | InputError:
    """The front of duration against energy as JSON, or why the request cannot be used."""
    try:
        return strict(planner.energy_time_front(request).to_json())
    except InputError as error:
        return error


def relief(name: str, most: int, report: bool = False) -> str | InputError:
    """Heights of a map for a picture, as JSON; see service.jobs.relief."""
    try:
        return strict(relief_of(name, most, report))
    except InputError as error:
        return error
