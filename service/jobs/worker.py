"""What a worker process does. Loaded once in the fork server, so that a fresh worker starts warm.

A worker lives for many requests, and no answer depends on earlier ones: the planner's caches go by
content, and a sampler of OMPL's runs in a fresh process. Functions here take and return plain data
that crosses a process border cheaply, and raise InputError for input that cannot be used. A
function that answers a question has the name of the planner's function that it calls.
"""

from __future__ import annotations

import planner

# Loaded with the fork server, so that a fresh worker has it.
import planner.search.front
import planner.search.graph
import planner.search.matrix
import planner.search.reach
from planner.power.catalogue import list_effects
from planner.power.vehicles import list_vehicles
from planner.report.routes import answer_view
from planner.search.plan import warm_up
from planner.search.requests import FrontRequest, MatrixRequest, PlanRequest, ReachRequest
from planner.search.route_graph import GraphRequest
from planner.search.situation import KINDS
from planner.terrain.catalogue import list_maps
from service.documents import finite, route_document, strict
from service.formats import FORMATS, written
from service.jobs.outcomes import Catalogues
from service.jobs.process import report as tell
from service.jobs.process import waited_s
from service.jobs.relief import ground_of, relief_of
from service.jobs.telemetry import adopt as adopt
from service.jobs.telemetry import check as check
from service.jobs.telemetry import check_model as check_model
from service.jobs.telemetry import compare as compare
from service.jobs.telemetry import demo_log as demo_log
from service.jobs.telemetry import diagnose as diagnose
from service.jobs.telemetry import model_report as model_report
from service.jobs.telemetry import revert as revert

LEAST_BUDGET_S = 1e-3
"""What is left of a time budget, s, when all of it was spent waiting: the grid still answers."""

warm_up()


def catalogues() -> Catalogues:
    """Lists of what is installed, ready for JSON."""
    return Catalogues(
        finite(list_maps()), finite(list_vehicles()), finite(list_effects()), tuple(KINDS)
    )


def plan_route(
    request: PlanRequest,
    report: bool = False,
    files: bool = False,
    baseline_poses: bool = False,
    format_: str = "json",
) -> str:
    """A request's answer in a format; its time budget counts from its arrival.

    Args:
        request: the question.
        report: whether the answer's pictures and tables, over the whole map, come as HTML.
        files: whether the answer comes in every other format too.
        baseline_poses: whether the shortest and the fastest route have their poses.
        format_: one of service.formats.FORMATS; only "json" has those three.
    """
    answer = planner.plan_route(less_waiting(request, waited_s()), progress=tell)
    if format_ != "json":
        return written(answer, format_)
    document = route_document(answer.to_json())
    if baseline_poses:
        for name, baseline in answer.baselines.items():
            document["baselines"][name]["poses"] = baseline.route.to_json()["poses"]
    if report:
        document["report"] = "".join(answer_view(answer, answer.terrain.extent).sections)
    if files:
        document["files"] = {
            name: written(answer, name) for name in FORMATS if name != "json" and answer.routes
        }
    return strict(document)


def less_waiting(request: PlanRequest, waited_s: float) -> PlanRequest:
    """The request with the time it waited subtracted from its time budget, if it came with one."""
    if "time_budget_s" not in request.model_fields_set:
        return request
    left = max(request.time_budget_s - waited_s, LEAST_BUDGET_S)
    return request.model_copy(update={"time_budget_s": left})


def energy_matrix(request: MatrixRequest) -> str:
    """Energies between places as JSON."""
    return strict(planner.energy_matrix(request).to_json())


def energy_graph(request: GraphRequest) -> str:
    """A graph with the energy of its edges as GeoJSON."""
    return strict(planner.energy_graph(request).to_json())


def reachable_area(request: ReachRequest) -> str:
    """The reachable area as JSON."""
    return strict(planner.reachable_area(request).to_json())


def energy_time_front(request: FrontRequest) -> str:
    """The Pareto front of duration and energy as JSON."""
    return strict(planner.energy_time_front(request).to_json())


def relief(name: str, most: int, report: bool = False) -> str:
    """Heights of a map for a picture, as JSON; see service.jobs.relief."""
    return strict(relief_of(name, most, report))


def ground(name: str, vehicle: str | None, model: str | None) -> str:
    """Where a robot cannot go on a map, as JSON; see service.jobs.relief."""
    return strict(ground_of(name, vehicle, model))
