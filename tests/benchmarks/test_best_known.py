"""The best known routes: cheaper than the answers, feasible, and straight where nothing bends."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tests.benchmarks.best_known import MOST_MAPS, drawn, questions, searched, summary
from tests.benchmarks.hard_maps import made
from tests.benchmarks.peers.case import Array, Case, case_of
from tests.benchmarks.peers.limits import broken_limits
from tests.benchmarks.random_search import ROUNDING, Known, RandomSearch, without_spur
from tests.search.maps import terrain

ACROSS = {"start": {"x": 2.0, "y": 5.0}, "goal": {"x": 8.0, "y": 5.0}}
STRAIGHT = np.array([[2.0, 5.0], [8.0, 5.0]])


def begun(case: Case, path: Array, seed: int = 1) -> RandomSearch:
    """A search that begins with one path."""
    search = RandomSearch(case, seed)
    route = case.drive(path)
    assert route is not None
    search.begin(route, path, "given")
    return search


@pytest.fixture(scope="module")
def among_rocks() -> tuple[dict[str, Known], RandomSearch]:
    _, case = next(questions("rocks", made("rocks", 3), 1, 3))
    return searched(case, seconds=1.0, seed=1, ten_seconds=0.5)


def test_no_answer_is_cheaper_than_the_best_known(
    among_rocks: tuple[dict[str, Known], RandomSearch],
) -> None:
    answers, search = among_rocks
    assert len(answers) == 2
    assert all(one.route.energy_j >= search.best.route.energy_j for one in answers.values())


def test_its_route_holds_all_limits_and_goes_where_it_was_asked_to(
    among_rocks: tuple[dict[str, Known], RandomSearch],
) -> None:
    _, search = among_rocks
    for known in search.pool:
        assert broken_limits(search.case, known.route) == {}
        x, y = known.route.arrays["x"], known.route.arrays["y"]
        assert (x[0], y[0]) == pytest.approx(search.case.start)
        assert (x[-1], y[-1]) == pytest.approx(search.case.goal)


def test_nothing_is_cheaper_than_straight_on_across_level_ground() -> None:
    case = case_of("test", ACROSS, terrain(np.zeros((40, 40))))
    straight = case.drive(STRAIGHT)
    assert straight is not None
    bent = np.array([[2.0, 5.0], [5.0, 6.5], [8.0, 5.0]])
    search = begun(case, bent)
    assert search.best.route.energy_j > 1.01 * straight.energy_j
    search.offer(STRAIGHT, "straight on")
    for _ in range(20):
        search.move()
        search.through_places()
    assert search.best.route.energy_j == pytest.approx(straight.energy_j, rel=1e-3)


def test_moves_straighten_a_bend_that_nothing_asks_for() -> None:
    case = case_of("test", ACROSS, terrain(np.zeros((40, 40))))
    straight = case.drive(STRAIGHT)
    assert straight is not None
    search = begun(case, np.array([[2.0, 5.0], [5.0, 6.5], [8.0, 5.0]]))
    for _ in range(100):
        search.move()
    assert search.best.route.energy_j < 1.005 * straight.energy_j
    assert search.best.source == "given + moves"


def test_what_breaks_a_limit_is_never_kept() -> None:
    """Shorter would be through the wall, and past its end closer than the body is wide."""
    solid = np.zeros((80, 80), bool)
    solid[:60, 38:42] = True
    ground = terrain(np.zeros(solid.shape), obstacles=solid)
    case = case_of("test", {"start": {"x": 4.0, "y": 8.0}, "goal": {"x": 16.0, "y": 8.0}}, ground)
    around = np.array([[4.0, 8.0], [8.0, 16.5], [12.0, 16.5], [16.0, 8.0]])
    search = begun(case, around)
    before = search.best.route.energy_j
    assert not search.offer(around[[0, -1]], "through the wall")
    grazing = np.array([[4.0, 8.0], [9.4, 15.1], [10.6, 15.1], [16.0, 8.0]])
    assert not search.offer(grazing, "along its end")
    for _ in range(40):
        search.move()
        assert all(use.share <= 1.0 + ROUNDING for use in search.best.route.limits)
        # Derived from the poses alone, the body is free of the wall as well.
        assert "clearance" not in broken_limits(case, search.best.route)
    assert search.best.route.energy_j < before


def test_a_place_in_a_dead_end_is_not_driven_to_and_back() -> None:
    there = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0]])
    back = np.array([[2.0, 2.0], [2.0, 1.0], [2.0, 0.0], [3.0, 0.0]])
    np.testing.assert_array_equal(without_spur(there, back, 1.0), [[0, 0], [1, 0], [2, 0], [3, 0]])
    on = np.array([[2.0, 2.0], [3.0, 2.0]])
    np.testing.assert_array_equal(without_spur(there, on, 1.0), [*there, [3, 2]])


def test_maps_differ_and_later_seeds_give_only_maps_that_they_make() -> None:
    maps = list(drawn(91))
    assert len(set(maps)) == len(maps) == MOST_MAPS
    names = [name for name, seed in maps if seed > 91]
    assert set(names) <= {"shelves", "rocks", "maze"}
    for (name, seed), (other, other_seed) in itertools.combinations(maps, 2):
        if name == other:
            assert not np.array_equal(made(name, seed).obstacles, made(other, other_seed).obstacles)


def test_one_bad_answer_is_enough_to_miss_a_bar() -> None:
    good = {"excess": {"at once": 0.05, "ten seconds": 0.01}}
    assert summary([good] * 5)["holds"]
    bad = {"excess": {"at once": 1.2, "ten seconds": 0.01}}
    assert not summary([*[good] * 5, bad])["holds"]
