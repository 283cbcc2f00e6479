"""Speeds found for one yaw profile after another are as good as those found for each alone."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.limit_places import Infeasible
from planner.search.resolution import MORE_LEVELS
from planner.search.results import energy_of
from planner.search.trajectory import speed_profile as profiles
from planner.search.trajectory.limit_checks import broken_limits
from planner.search.trajectory.motion import Motion
from planner.search.trajectory.speed_search import SpeedSearch
from planner.search.trajectory.track import lay_track, steps_of
from planner.search.trajectory.yaw import YawProfile
from tests.benchmarks.peers.case import case_of
from tests.search.maps import hills, terrain

PATH = np.array([[3.0, 4.0], [11.0, 6.0], [20.0, 12.0]])


def _circumstances(degrees: float):
    """Field, conditions, track and steps on hills."""
    asked = {
        "start": {"x": 3.0, "y": 4.0},
        "goal": {"x": 20.0, "y": 12.0},
    }
    situation = case_of("test", asked, terrain(hills(96, rms_degrees=degrees))).situation
    field, conditions = situation.field("energy"), situation.conditions
    limits = conditions.model.vehicle.limits
    track = lay_track(
        *(field, [PATH]), spacing=0.25, speed=limits.speed, acceleration=limits.acceleration
    )
    return field, conditions, track, steps_of(field, track)


@pytest.fixture(scope="module")
def circumstances():
    """Limits are broken between samples there, and speed is eased."""
    return _circumstances(9.0)


def _search(circumstances) -> SpeedSearch:
    return SpeedSearch(*circumstances, beside=3, levels=MORE_LEVELS, checked=True)


def _ahead(track, turned: float = 0.0, where: slice = slice(0, 0)) -> YawProfile:
    """Driving straight on, with the body turned on some samples and evenly on those beside."""
    turn = np.zeros(len(track.points))
    turn[where] = turned
    turn = np.convolve(turn, np.ones(5) / 5.0, mode="same")
    yaw = np.append(track.directions, track.directions[-1]) + turn
    return YawProfile(yaw, yaw, 0.0)


def test_a_body_turned_on_some_steps_is_driven_as_by_a_search_of_its_own(circumstances) -> None:
    field, conditions, track, _ = circumstances
    some = slice(20, 40)
    search = _search(circumstances)
    ahead = search.along(_ahead(track))
    for turned in (0.3, -0.2):
        known = search.along(_ahead(track, turned, some))
        alone = _search(circumstances).along(_ahead(track, turned, some))
        assert isinstance(known, Motion)
        assert not broken_limits(field, conditions, known, finely=True)
        joules = [energy_of(field, conditions, one) for one in (known, alone, ahead)]
        assert joules[0] == pytest.approx(joules[1], rel=5e-4)
        assert abs(joules[0] / joules[2] - 1.0) > 2e-3, "turning changes nothing"


def test_only_steps_with_another_yaw_are_estimated_again(circumstances, monkeypatch) -> None:
    _, _, track, _ = circumstances
    estimated = []
    estimate = profiles.estimate

    def counted(kernel, arrays, stretch, *rest):
        estimated.append(len(stretch.yaw))
        estimate(kernel, arrays, stretch, *rest)

    monkeypatch.setattr(profiles, "estimate", counted)
    search = _search(circumstances)
    search.along(_ahead(track))
    search.along(_ahead(track, 0.2, slice(30, 40)))
    search.along(_ahead(track, 0.2, slice(30, 40)))
    # Ten samples, two on either side that turn with them, and a step beside these.
    assert estimated == [len(track.lengths), 10 + 4 + 1 + 2]


def test_a_yaw_that_no_speed_allows_leaves_nothing_behind() -> None:
    steep = _circumstances(13.0)
    field, conditions, track, _ = steep
    everywhere = slice(None)
    search = _search(steep)
    refused = search.along(_ahead(track, -0.2, everywhere))
    assert isinstance(refused, Infeasible)
    assert "no speed" in refused.what
    found = search.along(_ahead(track, 0.3, everywhere))
    alone = _search(steep).along(_ahead(track, 0.3, everywhere))
    assert isinstance(found, Motion)
    assert isinstance(alone, Motion)
    joules = [energy_of(field, conditions, one) for one in (found, alone)]
    assert joules[0] == pytest.approx(joules[1], rel=1e-6)


def test_no_speed_by_what_is_known_is_looked_for_by_nothing_known(
    circumstances, monkeypatch
) -> None:
    """What was eased for one yaw profile may leave the next one no speed."""
    field, conditions, track, _ = circumstances
    turned = _ahead(track, 0.3, slice(20, 40))
    alone = _search(circumstances).along(turned)
    search = _search(circumstances)
    search.along(_ahead(track))
    known = []
    speed_profile = profiles.speed_profile

    def refused_once(*given):
        known.append(len(given[-2]))
        return (None, 30) if len(known) == 1 else speed_profile(*given)

    monkeypatch.setattr("planner.search.trajectory.speed_search.speed_profile", refused_once)
    found = search.along(turned)
    assert known[:2] == [1, 0]
    joules = [energy_of(field, conditions, one) for one in (found, alone)]
    assert joules[0] == pytest.approx(joules[1], rel=1e-6)
