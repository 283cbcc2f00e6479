"""The answer to a route request: routes with their energy, baselines, and what they rest on.

``Answer.to_json`` is the ROUTE.json of the documentation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.arrays import Array
from planner.search.results.energy_interval import Contribution, EnergyDistribution
from planner.search.results.finer_poses import poses_every
from planner.search.results.search_summary import SearchSummary
from planner.shown import Picture, Shown, frame
from planner.terrain.heightmap import Terrain

if TYPE_CHECKING:
    import pandas

    from planner.search.limit_places import LimitUse
    from planner.search.trajectory import Motion


@dataclass(frozen=True)
class Pose:
    """Where the robot is at a moment; between two poses position, yaw and speed change evenly.

    Metres in the map's frame, z the height at which it rides, rad, s since the start, m/s along
    the surface, J drawn since the start.
    """

    x: float
    y: float
    z: float
    yaw: float
    t: float
    speed: float
    energy_j: float


@dataclass(frozen=True)
class Battery:
    """Whether the route's energy fits the battery: J, and shares of what is in it."""

    available_j: float
    share: float
    fits: bool


@dataclass(frozen=True)
class Route:
    """One route and its energy account.

    Attributes:
        energy_j: J drawn from the source.
        lower_bound_j: J below which no route can be.
        gap: (energy_j - lower_bound_j) / (energy_j - M·g·Δz).
        duration_s, length_m: s; m along the surface.
        known: gives what is known of the energy; asked only for routes that are answered.
        breakdown_j: J by effect; adds up to energy_j.
        arrays: x, y, z, yaw, t, speed, energy_j, watts (mean since the pose before), each (n,).
        watts_by_effect: W since the pose before, by effect, each (n,).
        battery: None where the vehicle's battery is not known.
        motion: what was priced, for another model to price it.
        uses: finds how much of every limit is used; asked only for routes that are answered.
    """

    energy_j: float
    lower_bound_j: float
    gap: float
    duration_s: float
    length_m: float
    known: Callable[[], EnergyDistribution]
    breakdown_j: Mapping[str, float]
    arrays: Mapping[str, Array]
    watts_by_effect: Mapping[str, Array]
    battery: Battery | None = None
    motion: Motion | None = None
    uses: Callable[[], tuple[LimitUse, ...]] = tuple

    @cached_property
    def distribution(self) -> EnergyDistribution:
        """Of the energy that one drive would be measured to need."""
        return self.known()

    @cached_property
    def limits(self) -> tuple[LimitUse, ...]:
        """The largest share of every limit, and where and when it is reached."""
        return self.uses()

    @property
    def energy_interval_j(self) -> tuple[float, float]:
        """J, 95 %."""
        return self.distribution.interval_j

    @property
    def sensitivity(self) -> tuple[Contribution, ...]:
        """What the interval's width comes from, largest first."""
        return self.distribution.sensitivity

    @property
    def battery_chance(self) -> float | None:
        """Probability that the battery suffices; None where the battery is not known."""
        return None if self.battery is None else self.distribution.chance(self.battery.available_j)

    @property
    def poses(self) -> list[Pose]:
        """Every pose of the route."""
        names = ("x", "y", "z", "yaw", "t", "speed", "energy_j")
        columns = (self.arrays[name].tolist() for name in names)
        return [Pose(*values) for values in zip(*columns, strict=True)]

    @property
    def distance_m(self) -> Array:
        """(n,) m along the surface from the start to every pose."""
        steps = np.sqrt(sum(np.diff(self.arrays[k]) ** 2 for k in ("x", "y", "z")))
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def rise_m(self) -> float:
        """m from the start up to the end."""
        return float(self.arrays["z"][-1] - self.arrays["z"][0])

    @property
    def returned_j(self) -> float:
        """J that flow back to the source along the route."""
        return -float(np.minimum(np.diff(self.arrays["energy_j"]), 0.0).sum())

    def with_poses_every(self, seconds: float) -> Route:
        """The same route with poses at most so many s apart; its energy stays that of the motion.

        Only of a route that was priced, with its motion.
        """
        assert self.motion is not None
        times = self.arrays["t"]
        arrays = poses_every(self.motion, seconds)
        arrays["energy_j"] = np.interp(arrays["t"], times, self.arrays["energy_j"])
        before = np.searchsorted(times, arrays["t"] - 1e-12)
        arrays["watts"] = self.arrays["watts"][before]
        by_effect = {slug: watts[before] for slug, watts in self.watts_by_effect.items()}
        return replace(self, arrays=arrays, watts_by_effect=by_effect)

    def value(self, objective: str) -> float:
        """What an objective wants little of: J for "energy", s for "time", m for "length"."""
        return {"energy": self.energy_j, "time": self.duration_s, "length": self.length_m}[
            objective
        ]

    def to_frame(self) -> pandas.DataFrame:
        """The poses as a DataFrame: x, y, z, yaw, t, speed, energy_j, watts; one row a pose."""
        return frame({name: values.copy() for name, values in self.arrays.items()})

    def to_json(self, *, poses: bool = True) -> dict[str, Any]:
        """The route as in ROUTE.json; baselines leave the poses out."""
        numbers = ("energy_j", "lower_bound_j", "gap", "duration_s", "length_m")
        document: dict[str, Any] = {
            **{name: getattr(self, name) for name in numbers},
            "energy_interval_j": list(self.energy_interval_j),
            "sensitivity": [part.to_json() for part in self.sensitivity],
            "breakdown_j": dict(self.breakdown_j),
            "limits": [use.to_json() for use in self.limits],
        }
        if self.battery is not None:
            document["battery"] = {**vars(self.battery), "chance": self.battery_chance}
        if poses:
            names = ("x", "y", "z", "yaw", "t", "speed", "energy_j")
            columns = [self.arrays[n].tolist() for n in names]
            document["poses"] = [
                dict(zip(names, values, strict=True)) for values in zip(*columns, strict=True)
            ]
        return document


@dataclass(frozen=True)
class Baseline:
    """A route that another aim would have chosen, priced by the same model."""

    route: Route
    extra_share: float
    """Energy beyond the answer's, as a share of it: 0.23 costs 23 % more."""

    @property
    def energy_j(self) -> float:
        """J drawn from the source."""
        return self.route.energy_j

    @property
    def length_m(self) -> float:
        """m along the surface."""
        return self.route.length_m

    @property
    def duration_s(self) -> float:
        """s from start to goal."""
        return self.route.duration_s


@dataclass(frozen=True)
class Answer(Shown):
    """What ``plan_route`` returns.

    Attributes:
        status: "ok", or "no_route" with a reason that names what blocks.
        routes: best first; empty without a route.
        baselines: "shortest" and "fastest", within the same limits.
        planner: how the route was found.
        model: the power model that priced it.
        notes: what was assumed or could not be done, in sentences.
        cause: without a route, what is in the way: limit, value, allowed, x, y.
        terrain: the map.
        goal: where the best route ends, where the request left that open: x, y, yaw and, of several
            places, the number of the one.
    """

    status: str
    terrain: Terrain
    model: Mapping[str, Any]
    planner: SearchSummary
    routes: tuple[Route, ...] = ()
    baselines: Mapping[str, Baseline] = field(default_factory=dict)
    reason: str | None = None
    cause: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = ()
    goal: Mapping[str, float] | None = None

    def to_json(self) -> dict[str, Any]:
        """The answer as ROUTE.json."""
        document: dict[str, Any] = {"status": self.status}
        if self.reason is not None:
            document["reason"] = self.reason
        if self.cause is not None:
            document["cause"] = dict(self.cause)
        if self.goal is not None:
            document["goal"] = dict(self.goal)
        document["routes"] = [route.to_json() for route in self.routes]
        document["baselines"] = {
            name: {**baseline.route.to_json(poses=False), "extra_share": baseline.extra_share}
            for name, baseline in self.baselines.items()
        }
        document["planner"] = self.planner.to_json()
        document["model"] = dict(self.model)
        document["notes"] = list(self.notes)
        return document

    def to_frame(self) -> pandas.DataFrame:
        """The routes and baselines as a DataFrame, one row each, with J by effect as columns.

        Columns are ``route`` ("best", "alternative 1", …, "shortest", "fastest"), ``energy_j``,
        ``low_j`` and ``high_j`` (95 %), ``lower_bound_j``, ``gap``, ``duration_s``, ``length_m``,
        then the effects. The poses of one route are ``routes[0].to_frame()``.
        """
        named = {f"alternative {k}" if k else "best": r for k, r in enumerate(self.routes)}
        named |= {name: baseline.route for name, baseline in self.baselines.items()}
        return frame({"route": name, **_in_one_row(route)} for name, route in named.items())

    def plot(self) -> Picture:
        """The map with the route coloured by watts and its profiles; without a route the map."""
        return self.figure("overview" if self.routes else "map")


def _in_one_row(route: Route) -> dict[str, float]:
    low, high = route.energy_interval_j
    numbers = {"energy_j": route.energy_j, "low_j": low, "high_j": high}
    numbers |= {name: getattr(route, name) for name in ("lower_bound_j", "gap")}
    numbers |= {"duration_s": route.duration_s, "length_m": route.length_m}
    return {**numbers, **route.breakdown_j}
