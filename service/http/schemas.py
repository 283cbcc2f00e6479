"""Answers of the service, as models for the OpenAPI document.

Routes come out of a worker as finished JSON text and are passed on as they are; these models
describe them, and the tests hold the text against them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from fastapi import Response
from pydantic import BaseModel, ConfigDict, Field

from service.http.error_handlers import MEDIA_TYPE


class Described(BaseModel):
    """Base of all models here; docstrings of fields describe them in the OpenAPI document."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class Problem(Described):
    """An error, after RFC 9457."""

    type: str = Field(examples=["urn:joulepath:problem:bad-input"])
    title: str = Field(examples=["Unprocessable Content"])
    status: int = Field(examples=[422])
    detail: str = Field(
        examples=["start.x: is not a finite number (got nan); accepted: metres in the map's frame"]
    )
    field: str | None = Field(default=None, examples=["start.x"])
    accepted: str | None = Field(default=None, examples=["metres in the map's frame"])
    id: str | None = None
    """id of an unexpected failure in the service's log"""


_PROBLEMS = {
    404: "Nothing has this id.",
    408: "The body did not arrive in time.",
    406: "`Accept` asks for a format that routes do not have.",
    409: "Conflicts with the current state.",
    413: "The body is too large.",
    415: "The content type is not JSON.",
    422: "Invalid input; `field` names the field.",
    500: "Internal error.",
    503: "All workers are busy; retry after `Retry-After` seconds.",
    504: "The service's time limit was exceeded.",
    507: "The service's disk is full.",
}


def problem_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """OpenAPI descriptions of problem documents."""
    return {
        status: {"model": Problem, "content": {MEDIA_TYPE: {}}, "description": _PROBLEMS[status]}
        for status in statuses
    }


def described(
    content: Mapping[str, Any], responses: Mapping[Any, Any], *problems: int, status_code: int = 200
) -> dict[str, Any]:
    """Options of a route whose endpoint reads the body and writes the response itself.

    Args:
        content: OpenAPI description of the body by media type.
        responses: OpenAPI descriptions by status.
        problems: statuses of problem documents.
        status_code: usual status.
    """
    return {
        "response_class": Response,
        "status_code": status_code,
        "responses": {**responses, **problem_responses(*problems)},
        "openapi_extra": {"requestBody": {"required": True, "content": content}},
    }


def json_content(model: type[BaseModel], example: Mapping[str, Any]) -> dict[str, Any]:
    """OpenAPI description of a JSON body."""
    schema = {"$ref": f"#/components/schemas/{model.__name__}"}
    return {"application/json": {"schema": schema, "example": example}}


class Pose(Described):
    """Position, yaw and speed; linear in t between poses."""

    x: float
    """m, the map's frame"""
    y: float
    """m, the map's frame"""
    z: float
    """m, ground height averaged over the footprint"""
    yaw: float
    """rad, counter-clockwise from the map's x axis"""
    t: float
    """s since the start"""
    speed: float
    """m/s along the surface"""
    energy_j: float
    """J drawn since the start"""


class Battery(Described):
    """Whether the route's energy fits the battery."""

    available_j: float
    share: float
    """share of the available energy"""
    fits: bool
    chance: float | None = None
    """probability that the energy suffices, 0 to 1"""


class Contribution(Described):
    """What one parameter adds to the uncertainty of the energy."""

    effect: str
    """slug; "noise" for the scatter of one measured drive"""
    parameter: str
    joules_per_sd: float
    """J more when it is one standard deviation higher, correlated ones following"""
    share_of_variance: float
    """0 to 1; all add up to 1"""
    elasticity: float | None
    """relative change of the energy over that of this parameter alone"""


class LimitUse(Described):
    """How much of one limit a route uses at most, and where."""

    limit: str
    share: float
    """1 is the limit itself"""
    x: float
    """m, the map's frame"""
    y: float
    t: float
    """s since the start"""


class Cause(Described):
    """What is in the way where there is no route; null where nothing is measured."""

    limit: str | None
    value: float | None
    """reached there, SI"""
    allowed: float | None
    x: float | None
    """m, the map's frame"""
    y: float | None


class RouteSummary(Described):
    """Energy of a route and its account."""

    energy_j: float
    lower_bound_j: float
    """lower bound of the energy of any feasible route of the motion model, J"""
    gap: float
    """(energy - bound) as a share of the dissipated energy"""
    duration_s: float
    length_m: float
    energy_interval_j: tuple[float, float]
    """95 % interval of the measured energy of one drive, J"""
    sensitivity: list[Contribution] = []
    """contributions to the interval's width, largest first"""
    breakdown_j: dict[str, float]
    """J by effect; adds up to energy_j; gravity and inertia are exchange"""
    limits: list[LimitUse] = []
    """every limit, with the largest share used"""
    battery: Battery | None = None


class Route(RouteSummary):
    """A route with its poses."""

    poses: list[Pose]


class BaselineSummary(RouteSummary):
    """The shortest or the fastest route, priced by the same model."""

    extra_share: float
    """energy beyond the answer's: 0.23 costs 23 % more"""
    poses: list[Pose] | None = None
    """with `baseline_poses`"""


class _Outcome(Described):
    status: Literal["ok", "no_route"]
    reason: str | None = None
    """why there is no route"""
    cause: Cause | None = None
    """the same in numbers"""


class RouteAnswer(_Outcome):
    """ROUTE.json: a route, or why there is none."""

    goal: dict[str, float] | None = None
    """x, y, yaw where the best route ends if left open; number of the place among several"""
    routes: list[Route]
    """best first"""
    baselines: dict[str, BaselineSummary]
    """shortest and fastest, within the same limits as the route"""
    planner: dict[str, Any]
    """how the route was found"""
    model: dict[str, Any]
    """name, version and effects of the power model"""
    notes: list[str] = []
    """assumptions, and what could not be done"""
    report: str | None = None
    """with `report`: pictures and tables as HTML"""
    files: dict[str, str] | None = None
    """with `files`: the routes as text in every other format, by its name"""


class FrontRoute(Route):
    """A route of a front, and the prices of time at which it is the best of them."""

    price_w: tuple[float, float | None]
    """W, price per second saved against the next slower and next faster route; null if fastest"""


class FrontAnswer(_Outcome):
    """Pareto front of duration and energy, or why there is none."""

    points: list[FrontRoute]
    """fastest first, so energy falls"""
    searches: int
    """number of prices of time searched between the ends"""
    model: dict[str, Any]
    """name, version and effects of the power model"""
    notes: list[str] = []
    """assumptions"""


class MatrixAnswer(Described):
    """Energies between places."""

    starts: list[dict[str, float]]
    goals: list[dict[str, float]]
    energy_j: list[list[float | None]]
    """J, a row for each start, a column for each goal; null where there is no route"""
    driven: int
    """number of pairs with a fully computed motion"""
    error_share: float | None
    """relative error that nine in ten of the other pairs stay within, if known"""
    notes: list[str] = []
    """assumptions"""


class GraphAnswer(Described):
    """GeoJSON of a graph; edges that can be driven have cost, overridable and metadata."""

    model_config = ConfigDict(extra="allow")

    type: Literal["FeatureCollection"]
    features: list[dict[str, Any]]
    joulepath: dict[str, Any]
    """what was asked; closed: directions that cannot be driven, and why; notes: assumptions"""


class ReachAnswer(Described):
    """Area that can be reached with an energy."""

    start: dict[str, float]
    energy_j: float
    and_back: bool
    area_m2: float
    outlines: list[list[tuple[float, float]]]
    """closed lines of x, y around the area and around holes in it, m"""
    error_share: float | None
    """largest relative error at the edge, before the last round of checks"""
    checked: int
    """number of places with a fully computed route"""
    notes: list[str] = []
    """assumptions"""


class Entry(Described):
    """An entry of a catalogue."""

    model_config = ConfigDict(extra="allow")

    name: str
    """name for requests"""
    title: str | None = None


class Relief(Described):
    """Heights of a map for a picture, at reduced resolution."""

    name: str
    columns: int
    rows: int
    origin: tuple[float, float]
    """x, y of the first height, m"""
    cell: tuple[float, float]
    """dx, dy between heights, m"""
    extent: tuple[float, float, float, float]
    """xmin, ymin, xmax, ymax, m"""
    heights: list[float | None]
    """m, row by row from the south"""
    blocked: list[int]
    """1 at obstacles, 0 elsewhere"""


class Ground(Described):
    """Where a robot cannot go on a map, and the kinds of its ground."""

    report: str
    """SVG of the size of the map's picture, and a legend, as HTML"""


class WorkersHealth(Described):
    """How busy the workers are."""

    alive: bool
    workers: int
    busy: int
    waiting: int


class Health(Described):
    """Whether the service can plan."""

    status: Literal["ok", "failing"]
    version: str
    workers: WorkersHealth
    store: str = Field(examples=["ok"])
    """ok, or why the store cannot be used any more"""
