"""What the service answers, as models for the OpenAPI document.

Routes come out of a worker as finished JSON text and are passed on as they are; these models
describe them, and the tests hold the text against them.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from service.http.error_handlers import MEDIA_TYPE


class Problem(BaseModel):
    """An error, after RFC 9457."""

    type: str = Field(examples=["urn:joulepath:problem:bad-input"])
    title: str = Field(examples=["Unprocessable Content"])
    status: int = Field(examples=[422])
    detail: str = Field(
        examples=["start.x: is not a finite number (got nan); accepted: metres in the map's frame"]
    )
    field: str | None = Field(default=None, examples=["start.x"])
    accepted: str | None = Field(default=None, examples=["metres in the map's frame"])
    id: str | None = Field(default=None, description="of an unexpected failure in the log")


_PROBLEMS = {
    404: "Nothing has this id.",
    409: "It cannot be done in the state that things are in.",
    413: "The body is larger than the service takes.",
    415: "The body is not said to be JSON.",
    422: "Something in the request cannot be used; `field` says what.",
    500: "Something failed inside the service.",
    503: "All workers are busy; `Retry-After` says when to try again.",
    504: "The service's time limit was reached.",
    507: "The service's disk is full.",
}


def problem_responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """How a route's problems are described in the OpenAPI document."""
    return {
        status: {"model": Problem, "content": {MEDIA_TYPE: {}}, "description": _PROBLEMS[status]}
        for status in statuses
    }


class Pose(BaseModel):
    """Position, yaw and speed change evenly in t from one pose to the next."""

    x: float = Field(description="m, the map's frame")
    y: float = Field(description="m, the map's frame")
    z: float = Field(description="m, height at which the robot rides")
    yaw: float = Field(description="rad, counter-clockwise from the map's x axis")
    t: float = Field(description="s since the start")
    speed: float = Field(description="m/s along the surface")
    energy_j: float = Field(description="J drawn since the start")


class Battery(BaseModel):
    """Whether the route's energy fits the battery."""

    available_j: float
    share: float = Field(description="of what is available")
    fits: bool
    chance: float | None = Field(default=None, description="that it suffices, 0 to 1")


class Contribution(BaseModel):
    """What one parameter adds to the uncertainty of the energy."""

    effect: str = Field(description='slug; "noise" for the scatter of one measured drive')
    parameter: str
    joules_per_sd: float = Field(
        description="J more when it is one standard deviation higher, correlated ones following"
    )
    share_of_variance: float = Field(description="0 to 1; all add up to 1")
    elasticity: float | None = Field(
        description="relative change of the energy over that of this parameter alone"
    )


class RouteSummary(BaseModel):
    """Energy of a route and its account."""

    energy_j: float
    lower_bound_j: float = Field(description="no feasible route of the motion model costs less")
    gap: float = Field(description="(energy - bound) as a share of the dissipated energy")
    duration_s: float
    length_m: float
    energy_interval_j: tuple[float, float] = Field(
        description="95 %, of the energy that one drive is measured to take"
    )
    sensitivity: list[Contribution] = Field(
        default=[], description="what the interval's width comes from, largest first"
    )
    breakdown_j: dict[str, float] = Field(
        description="J by effect; adds up to energy_j; gravity and inertia are exchange"
    )
    battery: Battery | None = None


class Route(RouteSummary):
    """A route with its poses."""

    poses: list[Pose]


class BaselineSummary(RouteSummary):
    """The shortest or the fastest route, priced by the same model."""

    extra_share: float = Field(description="energy beyond the answer's: 0.23 costs 23 % more")


class RouteAnswer(BaseModel):
    """ROUTE.json."""

    status: Literal["ok", "no_route"]
    reason: str | None = Field(default=None, description="what blocks, when there is no route")
    goal: dict[str, float] | None = Field(
        default=None,
        description="x, y, yaw where the best route ends, where the request left that open; of "
        "several places, the number of the one, from 0",
    )
    routes: list[Route] = Field(description="best first")
    baselines: dict[str, BaselineSummary] = Field(
        description="shortest and fastest, within the same limits as the route"
    )
    baselines_absent: dict[str, str] = Field(
        default={}, description="why a baseline is missing, by its name"
    )
    planner: dict[str, Any] = Field(description="how the route was found")
    model: dict[str, Any] = Field(description="name, version and effects of the power model")
    notes: list[str] = Field(default=[], description="what was assumed or could not be done")


class FrontRoute(Route):
    """A route of a front, and the prices of time at which it is the best of them."""

    price_w: tuple[float, float | None] = Field(
        description="W: what each second costs that it saves against the next slower route, and "
        "what each would cost to the next faster one; null for the fastest"
    )


class FrontAnswer(BaseModel):
    """What a second costs."""

    status: Literal["ok", "no_route"]
    reason: str | None = Field(default=None, description="what blocks, when there is no route")
    points: list[FrontRoute] = Field(description="fastest first, so energy falls")
    searches: int = Field(description="prices of time that were searched at between the ends")
    model: dict[str, Any] = Field(description="name, version and effects of the power model")


class MatrixAnswer(BaseModel):
    """Energies between places."""

    starts: list[dict[str, float]]
    goals: list[dict[str, float]]
    energy_j: list[list[float | None]] = Field(
        description="a row for each start, a column for each goal; null where there is no way"
    )
    driven: int = Field(description="pairs whose motion was worked out in full")
    error_share: float | None = Field(
        description="relative error that nine of ten of the other pairs keep to, as far as known"
    )


class ReachAnswer(BaseModel):
    """What can be reached with an energy."""

    start: dict[str, float]
    energy_j: float
    and_back: bool
    area_m2: float
    outlines: list[list[tuple[float, float]]] = Field(
        description="closed lines of x, y around the area and around holes in it, m"
    )
    error_share: float | None = Field(
        description="largest relative error at the edge, before the last round of checks"
    )
    checked: int = Field(description="places whose routes were worked out in full")


class Entry(BaseModel):
    """An entry of a catalogue."""

    model_config = ConfigDict(extra="allow")

    name: str = Field(description="what a request calls it")
    title: str | None = None


class Relief(BaseModel):
    """Heights of a map, thinned out for a picture."""

    name: str
    columns: int
    rows: int
    origin: tuple[float, float] = Field(description="x, y of the first height, m")
    cell: tuple[float, float] = Field(description="dx, dy between heights, m")
    extent: tuple[float, float, float, float] = Field(description="xmin, ymin, xmax, ymax, m")
    heights: list[float | None] = Field(description="m, row by row from the south")
    blocked: list[int] = Field(description="1 where an obstacle stands")


class WorkersHealth(BaseModel):
    """How busy the workers are."""

    alive: bool
    workers: int
    busy: int
    waiting: int


class Health(BaseModel):
    """Whether the service can plan."""

    status: Literal["ok", "failing"]
    version: str
    workers: WorkersHealth
