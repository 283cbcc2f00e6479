"""Start and stop in the certified bound: they gain, and no motion undercuts it for that."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.certificate import start_and_stop
from planner.search.certificate.certified_bound import certify
from planner.search.conditions import OperatingConditions
from planner.search.field import CostField, sample_surface
from planner.search.trajectory import Motion, motion_rows
from tests.search.certificate.robots import field_of, model_of
from tests.search.maps import terrain

START, GOAL = (2.0, 3.0), (10.0, 3.0)


def plane(slope: float) -> tuple[CostField, OperatingConditions]:
    """Ground that rises along x."""
    heights = np.tile(slope * 0.25 * np.arange(50), (26, 1))
    return field_of(terrain(heights, cell=0.25), model_of("minibalance"))


def straight(
    field: CostField, end: float, up: float, down: float, full: float, turned: float
) -> Motion:
    """From START along x at even accelerations, m/s², and at most a speed, the body turned."""
    x = np.linspace(START[0], end, max(400, math.ceil((end - START[0]) / 0.02)) + 1)
    xy = np.column_stack([x, np.full(len(x), START[1])])
    z, _ = sample_surface(field, xy)
    lengths = np.hypot(np.diff(x), np.diff(z))
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    speed = np.sqrt(2.0 * np.minimum(up * along, down * (along[-1] - along)))
    speed = np.minimum(speed, full)
    time = np.concatenate([[0.0], np.cumsum(2.0 * lengths / (speed[1:] + speed[:-1]))])
    nothing = np.zeros(len(lengths))
    yaw = np.full(len(x), turned)
    return Motion(xy[:, 0], xy[:, 1], z, yaw, time, speed, nothing, nothing)


def energy(field: CostField, conditions: OperatingConditions, motion: Motion) -> float:
    """J by the model along a motion."""
    rows, seconds, _ = motion_rows(field, motion, conditions.class_rows, conditions.wind)
    return float(conditions.model.watts(rows) @ seconds)


def least_of(field: CostField, conditions: OperatingConditions, end: float = GOAL[0]) -> float:
    """J of the best of many ways to speed up and to stop, from START to x = end."""
    most, top = conditions.model.vehicle.limits.acceleration, float(conditions.limits[0])
    return min(
        energy(field, conditions, straight(field, end, up, down, full, turned))
        for up in most * np.array([0.2, 0.4, 0.6, 0.8, 1.0])
        for down in most * np.array([0.2, 0.4, 0.6, 0.8, 1.0])
        for full in top * np.array([0.8, 0.9, 1.0])
        for turned in (0.0, 0.02, math.pi / 4.0)
    )


@pytest.mark.parametrize("slope", [-0.06, 0.0, 0.06])
def test_start_and_stop_count(slope: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound is close to the best of hundreds of ramps, and closer than without the ends."""
    field, conditions = plane(slope)
    least = least_of(field, conditions)
    found = certify(field, conditions, START, GOAL, seconds=600.0).bound_j
    monkeypatch.setattr(
        start_and_stop.StartAndStop, "paid", lambda _self, _prices, costs, *_: (costs, 0.0)
    )
    without = certify(field, conditions, START, GOAL, seconds=600.0).bound_j
    climb = conditions.mass * 9.80665 * slope * (GOAL[0] - START[0])
    assert found < least
    assert found > without + 0.02 * (least - climb)
    assert least - found < 0.09 * (least - climb)


@pytest.mark.parametrize(
    ("slope", "what"), [(0.0, "held"), (-0.06, "held"), (0.0, "steeper"), (-0.06, "steeper")]
)
def test_any_choice_of_ramps_gives_a_bound(
    slope: float, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Triangles are charged with all that the ends gain at rest beyond what is paid for."""
    field, conditions = plane(slope)
    chosen, paid = start_and_stop.StartAndStop.ramp, start_and_stop.StartAndStop.paid
    gains = []

    def bolder(self, *asked):
        ramp = chosen(self, *asked)
        return ramp._replace(held=1.25 * ramp.held, fall=1.25 * ramp.fall)

    def counted(self, *asked):
        costs, gain = paid(self, *asked)
        gains.append(gain)
        return costs, gain

    monkeypatch.setattr(start_and_stop.StartAndStop, "paid", counted)
    careful = certify(field, conditions, START, GOAL, seconds=600.0).bound_j
    before = max(gains)
    gains.clear()
    if what == "steeper":
        # The potential of slow motion falls within a few decimetres: that must be paid for.
        monkeypatch.setattr(start_and_stop, "CONE_WIDTH", 0.5)
    else:
        monkeypatch.setattr(start_and_stop.StartAndStop, "ramp", bolder)
    found = certify(field, conditions, START, GOAL, seconds=600.0)
    assert found.how == "potential"
    if what == "steeper":
        assert max(gains) > 0.2 * before
        assert found.bound_j < careful - 0.5
    else:
        assert max(gains) > 1.05 * before
        assert found.bound_j < careful + 0.1
    assert found.bound_j < least_of(field, conditions)


@pytest.mark.parametrize("apart", [0.25, 0.5, 0.8, 1.5])
def test_places_side_by_side(apart: float) -> None:
    """Nodes beside each other, where both ends would want the same triangles."""
    field, conditions = plane(0.0)
    end = START[0] + apart
    found = certify(field, conditions, START, (end, START[1]), seconds=600.0)
    assert found.how == "potential"
    assert 0.0 < found.bound_j < least_of(field, conditions, end)
