"""The yaw is refined at the speeds that are driven: what it costs there falls, and limits hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import plan_route
from planner.power.model import PowerModel
from planner.power.motion_row import set_motion
from planner.power.vehicles import load_vehicle
from planner.quantities import INDEX, ROW_LENGTH
from planner.search.requests import PlanRequest
from planner.search.results import energy_of
from planner.search.situation import situation_of
from planner.search.trajectory import drive
from planner.search.trajectory.drive import move
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.trajectory.motion import Motion
from planner.search.trajectory.refinement import rounds
from planner.search.trajectory.refinement.yaw_refinement import refined_yaw, turned_on_ground
from planner.search.trajectory.track import Track, steps_of
from planner.search.trajectory.turn_on_the_spot import first_contact
from planner.search.trajectory.yaw import YawProfile
from tests.benchmarks.hard_maps import made, places
from tests.search.maps import drawn, hills, terrain

PATH = np.array([[3.0, 4.0], [9.0, 5.0], [13.0, 10.0], [14.0, 16.0], [20.0, 18.0]])


def _circumstances(relief, effects=()):
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=effects)
    (x, y), (to_x, to_y) = PATH[0], PATH[-1]
    ends = {"start": {"x": x, "y": y}, "goal": {"x": to_x, "y": to_y}}
    request = PlanRequest.from_json({"map": "test", **ends})
    situation = situation_of(request, terrain=relief, model=model)
    return situation.field("energy"), situation.conditions


def _moved(field, conditions, path=PATH, yaws=(None, None), **how) -> Motion:
    motion = move(field, conditions, [path], yaws, **how)
    assert isinstance(motion, Motion)
    return motion


def _on_its_own_track(motion: Motion) -> tuple[Track, YawProfile]:
    """A motion without turns on the spot as a track with its yaw."""
    points = np.column_stack([motion.x, motion.y])
    steps = np.diff(points, axis=0)
    stops = np.zeros(len(points), bool)
    stops[[0, -1]] = True
    directions, lengths = np.arctan2(steps[:, 1], steps[:, 0]), np.hypot(*steps.T)
    assert lengths.min() > 0.0
    track = Track(points, directions, lengths, motion.curvatures, stops, (0, len(points) - 1))
    return track, YawProfile(motion.yaw, motion.yaw.copy(), 0.0)


@pytest.fixture(scope="module")
def rough():
    """Field, conditions, and a motion across hills whose yaw is not refined."""
    field, conditions = _circumstances(terrain(hills(96, rms_degrees=5.0)))
    return field, conditions, _moved(field, conditions, checked=False)


def test_another_yaw_at_the_same_speeds_costs_less(rough) -> None:
    field, conditions, motion = rough
    track, yaw = _on_its_own_track(motion)
    steps = steps_of(field, track)
    finer = refined_yaw(field, conditions, track, steps, yaw, motion, np.zeros(len(motion.x), bool))
    before = energy_of(field, conditions, motion)
    after = energy_of(field, conditions, replace(motion, yaw=finer.arriving))
    assert after < 0.999 * before
    # What is left to gain the same way is small.
    again = refined_yaw(
        field,
        conditions,
        track,
        steps,
        finer,
        replace(motion, yaw=finer.arriving),
        np.zeros(len(motion.x), bool),
    )
    least = energy_of(field, conditions, replace(motion, yaw=again.arriving))
    assert after - 0.3 * (before - after) < least <= after * (1.0 + 1e-4)


def test_yaw_stays_where_it_is_fixed(rough) -> None:
    field, conditions, motion = rough
    track, yaw = _on_its_own_track(motion)
    fixed = np.zeros(len(motion.x), bool)
    fixed[::7] = True
    finer = refined_yaw(field, conditions, track, steps_of(field, track), yaw, motion, fixed)
    np.testing.assert_array_equal(finer.arriving[fixed], motion.yaw[fixed])
    assert np.abs(finer.arriving - motion.yaw).max() > 0.01


def test_a_refined_motion_keeps_limits_and_the_yaws_asked_for(rough) -> None:
    field, conditions, plain = rough
    motion = _moved(field, conditions)
    assert energy_of(field, conditions, motion) < 0.998 * energy_of(field, conditions, plain)
    assert not broken_limits(field, conditions, motion, finely=True)
    turned = _moved(field, conditions, yaws=(0.7, -1.2))
    assert turned.yaw[0] == pytest.approx(0.7)
    assert np.exp(1j * turned.yaw[-1]) == pytest.approx(np.exp(-1.2j))


def test_a_body_turns_more_evenly_through_tight_corners() -> None:
    """Two bends in a row: less of the time is near the largest yaw rate, and it takes no more J."""
    field, conditions = _circumstances(terrain(np.zeros((96, 96))))
    path = np.array([[2.0, 5.0], [5.0, 5.0], [5.4, 5.4], [5.4, 8.0]])
    motion = _moved(field, conditions, path, checked=False)
    track, yaw = _on_its_own_track(motion)
    free, seconds = np.zeros(len(motion.x), bool), np.diff(motion.time)

    def fast(evenly: bool) -> float:
        finer = refined_yaw(
            field, conditions, track, steps_of(field, track), yaw, motion, free, evenly=evenly
        )
        rate = np.abs(np.diff(finer.arriving)) / seconds
        return float(seconds[rate > 0.9 * conditions.model.vehicle.limits.yaw_rate].sum())

    assert fast(True) < 0.5 * fast(False)
    once = drive.CLOSELY._replace(refined=1)
    plain, evenly = (_moved(field, conditions, path, care=care) for care in (once, drive.CLOSELY))
    assert energy_of(field, conditions, evenly) <= energy_of(field, conditions, plain) + 1e-9


def test_no_model_finds_a_cheaper_profile_for_another(rough) -> None:
    """On one path, each model's own yaw and speed cost it least; 0.05 % are for both searches."""
    relief = terrain(hills(96, rms_degrees=5.0))
    sets = ((), ("regeneration_limit",), ("viscous_drag", "driver_loss"))
    driven = [(*_circumstances(relief, effects), effects) for effects in sets]
    motions = [_moved(field, conditions) for field, conditions, _ in driven]
    for own, (field, conditions, effects) in zip(motions, driven, strict=True):
        least = min(energy_of(field, conditions, other) for other in motions)
        assert energy_of(field, conditions, own) <= 1.0005 * least, effects


def test_a_refined_body_touches_nothing() -> None:
    """A winding passage as wide as the body with its clearance and some centimetres."""
    picture = np.ones((80, 200), bool)
    picture[12:32, 5:110] = False
    picture[12:60, 90:110] = False
    picture[40:60, 90:195] = False
    text = "\n".join("".join("#" if solid else "." for solid in row) for row in picture[::-1])
    field, conditions = _circumstances(drawn(text, cell=0.05))
    path = np.array([[1.0, 1.1], [5.0, 1.1], [5.0, 2.5], [9.0, 2.5]])
    plain = _moved(field, conditions, path, checked=False)
    motion = _moved(field, conditions, path)
    assert first_contact(field, motion) < 0
    assert energy_of(field, conditions, motion) <= energy_of(field, conditions, plain) * 1.0005
    track, yaw = _on_its_own_track(plain)
    none = np.zeros(len(plain.x), bool)
    finer = refined_yaw(field, conditions, track, steps_of(field, track), yaw, plain, none)
    assert np.abs(finer.arriving - plain.yaw).max() > 0.005
    assert first_contact(field, replace(plain, yaw=finer.arriving)) < 0


def test_a_refined_motion_that_costs_more_is_left(rough, monkeypatch):
    """The speeds are chosen again for the refined yaw, so that it may cost more in the end."""
    field, conditions, _ = rough
    seen = []

    def swinging(field, conditions, track, steps, yaw, motion, fixed, evenly):
        seen.append(track)
        added = 0.4 * np.sin(np.linspace(0.0, 4.0 * np.pi, len(yaw.arriving)))
        return YawProfile(yaw.arriving + added, yaw.leaving + added, yaw.cost)

    def as_it_is(field, conditions, track, steps, yaw, motion, fixed, evenly):
        return yaw

    monkeypatch.setattr(rounds, "refined_yaw", as_it_is)
    plain = _moved(field, conditions)
    monkeypatch.setattr(rounds, "refined_yaw", swinging)
    kept = _moved(field, conditions)
    assert len(seen) == 2  # once for its costs, once to turn evenly; both keep all limits
    assert energy_of(field, conditions, kept) == energy_of(field, conditions, plain)


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.4])
def test_the_body_turns_on_its_ground_by_what_geometry_says(slope):
    """Turns of 0.1°: gravity in the body's frame, written for the yaw before and after."""
    added = np.radians(0.1)
    for yaw in np.radians([0.0, 20.0, 90.0, 135.0, -70.0]):
        before, after = np.zeros(ROW_LENGTH), np.zeros(ROW_LENGTH)
        set_motion(before, 0.6 * slope, -0.8 * slope, yaw, 1.0, 0.5)
        set_motion(after, 0.6 * slope, -0.8 * slope, yaw + added, 1.0, 0.5)
        angle = turned_on_ground(before) * added
        for x, y in (("gravity_x", "gravity_y"), ("vx", "vy")):
            ahead, left = before[INDEX[x]], before[INDEX[y]]
            turned = [
                np.cos(angle) * ahead + np.sin(angle) * left,
                np.cos(angle) * left - np.sin(angle) * ahead,
            ]
            expected = [after[INDEX[x]], after[INDEX[y]]]
            np.testing.assert_allclose(turned, expected, atol=2.0 * added**2)


def test_a_refined_yaw_is_driven_on_steep_relief(monkeypatch):
    """Cells of 30 m: samples see the steepest ground of each step, as the speed profile does."""
    times: dict[int, int] = {}
    motions = []

    def counted(field, conditions, track, steps, yaw, motion, fixed, evenly):
        motions.append(motion)
        times[id(motion)] = times.get(id(motion), 0) + (not evenly)
        return refined_yaw(field, conditions, track, steps, yaw, motion, fixed, evenly=evenly)

    monkeypatch.setattr(rounds, "refined_yaw", counted)
    terrain = made("jacksboro", 1)
    *_, asked = places(terrain, 2, 1)
    assert plan_route(terrain=terrain, **asked).status == "ok"
    assert 1 <= max(times.values()) <= 2
