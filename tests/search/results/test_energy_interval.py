"""What is known of a route's energy, on motions whose energy is known by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from planner import plan_route
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.saved import EnergyError, ParameterCovariance
from planner.power.vehicles import load_vehicle
from planner.search.results import energy_account
from planner.search.results.energy_interval import (
    MOST_ROUTE_ROWS,
    EnergyDistribution,
    energy_distribution,
    thinned,
)
from tests.search.maps import terrain

ELECTRONICS = ("electronics", "power", 0)
ROLLING = ("wheel_rolling", "rolling", 0)
SECONDS = np.full(50, 2.0)
"""s that each row stands for: 100 s in all."""


def quiet_error(**changes):
    """An error of drives without any noise, tried on endlessly many runs."""
    given = {
        "powers_w": (0.0,),
        "spreads_w": (0.0,),
        "correlation_time_s": 0.5,
        "run_offset_w": 0.0,
        "run_gain": 0.0,
        "scale": 1.0,
        "degrees_of_freedom": 1e9,
        "runs": 100,
    }
    return EnergyError(**{**given, **changes})


def known(model, seconds=SECONDS, *, speed=0.6):
    rows = rows_from(vx=np.full(len(seconds), speed))
    return energy_distribution(model, rows, seconds, float(model.watts(rows) @ seconds))


def knowing(model, names, values, **changes):
    """The model with a covariance of these parameters alone."""
    covariance = ParameterCovariance(tuple(names), np.array(values, float))
    return replace(model, covariance=covariance, energy_error=quiet_error(**changes))


@pytest.fixture(scope="module")
def model():
    return PowerModel.from_vehicle(load_vehicle("minibalance"), effects=())


def half_width(distribution):
    low, high = distribution.interval_j
    assert 0.5 * (low + high) == pytest.approx(distribution.energy_j)
    return 0.5 * (high - low)


def test_watts_that_are_always_there_add_watts_times_seconds(model):
    """Electronics of 5.3 ± 0.1 W over 100 s: ±10 J, and 530 J of the energy hang on them."""
    found = known(knowing(model, [ELECTRONICS], [[0.1**2]]))
    assert found.deviation_j == pytest.approx(10.0, rel=1e-5)
    assert half_width(found) == pytest.approx(1.959964 * 10.0, rel=1e-5)
    (part,) = found.sensitivity
    assert (part.effect, part.parameter) == ("electronics", "power")
    assert part.joules_per_sd == pytest.approx(10.0, rel=1e-5)
    assert part.share_of_variance == pytest.approx(1.0)
    assert part.elasticity == pytest.approx(530.0 / found.energy_j, rel=1e-5)


def test_errors_that_make_up_for_each_other_leave_nothing_open(model):
    """Where a log knows only a sum, a drive like it is known; alone each part would not be."""
    slope = known(knowing(model, [ROLLING], [[1e-4]])).sensitivity[0].joules_per_sd / 1e-2
    watts, rolling = 1.0, 100.0 / slope  # 100 J of a drive each
    both = -watts * rolling
    tied = knowing(model, [ELECTRONICS, ROLLING], [[watts**2, both], [both, rolling**2]])
    apart = knowing(model, [ELECTRONICS, ROLLING], [[watts**2, 0.0], [0.0, rolling**2]])
    assert known(apart).deviation_j == pytest.approx(100.0 * math.sqrt(2.0), rel=1e-4)
    assert known(tied).deviation_j == pytest.approx(0.0, abs=0.1)
    # Rolling costs nothing on the spot: there the electronics stand alone.
    assert known(tied, speed=0.0).deviation_j == pytest.approx(100.0, rel=1e-4)


def test_shares_add_up_and_are_sorted(model):
    """With correlations and noise too; none is negative."""
    values = [[0.5**2, -0.9 * 0.5 * 0.005], [-0.9 * 0.5 * 0.005, 0.005**2]]
    found = known(knowing(model, [ELECTRONICS, ROLLING], values, run_offset_w=0.2))
    shares = [part.share_of_variance for part in found.sensitivity]
    assert sum(shares) == pytest.approx(1.0)
    assert min(shares) >= 0.0
    assert shares == sorted(shares, reverse=True)
    noise = next(part for part in found.sensitivity if part.effect == "noise")
    assert noise.joules_per_sd == pytest.approx(0.2 * 100.0)
    assert noise.elasticity is None
    assert all(part.joules_per_sd <= found.deviation_j for part in found.sensitivity)


def test_noise_of_rows_averages_out_and_that_of_runs_does_not(model):
    """Four times as long: twice the scatter of rows, four times that of a run's offset."""
    rows = knowing(model, [], np.zeros((0, 0)), spreads_w=(0.5,))
    runs = knowing(model, [], np.zeros((0, 0)), run_offset_w=0.5)
    assert known(rows).deviation_j == pytest.approx(0.5 * math.sqrt(0.5 * 100.0))
    for noisy, factor in ((rows, 2.0), (runs, 4.0)):
        longer = known(noisy, np.full(200, 2.0))
        assert longer.deviation_j == pytest.approx(factor * known(noisy).deviation_j)


def test_noise_in_proportion_to_the_energy(model):
    found = known(knowing(model, [], np.zeros((0, 0)), run_gain=0.01))
    assert found.deviation_j == pytest.approx(0.01 * found.energy_j)


def test_held_out_runs_widen_the_interval(model):
    """By their scatter, and by Student's t where they were few."""
    wide = known(knowing(model, [ELECTRONICS], [[0.01]], scale=1.5))
    few = known(knowing(model, [ELECTRONICS], [[0.01]], degrees_of_freedom=5.0))
    assert half_width(wide) == pytest.approx(1.5 * 1.959964 * 10.0, rel=1e-5)
    assert half_width(few) == pytest.approx(2.570582 * 10.0, rel=1e-5)


def test_never_calibrated_every_parameter_has_its_declared_spread(model):
    """And they are independent: the variance is the sum of the squares of the single ones."""
    found = known(model)
    assert math.isinf(found.degrees_of_freedom)
    alone = [
        known(replace(model, stderr=np.where(np.arange(len(model.parameters)) == k, np.nan, 0.0)))
        for k in range(len(model.parameters))
    ]
    squares = sum(one.deviation_j**2 for one in alone)
    assert found.deviation_j == pytest.approx(math.sqrt(squares), rel=1e-9)


def test_chance_of_a_battery():
    """Even at the planned energy; 97.5 % at the upper end of the interval."""
    found = EnergyDistribution(1000.0, 20.0, 7.0)
    assert found.chance(1000.0) == pytest.approx(0.5)
    assert found.chance(found.interval_j[1]) == pytest.approx(0.975)
    assert found.chance(found.interval_j[0]) == pytest.approx(0.025)
    assert found.chance(1030.0) == pytest.approx(float(stats.t.cdf(1.5, 7.0)))
    assert EnergyDistribution(1000.0, 0.0).chance(999.9) == 0.0
    assert EnergyDistribution(1000.0, 0.0).chance(1000.0) == 1.0


def test_few_rows_stand_for_a_long_route(model):
    """The interval of 20,000 rows within a percent of that of all of them."""
    rng = np.random.default_rng(4)
    rows = rows_from(vx=0.5 + 0.4 * np.sin(np.arange(20_000) / 500.0))
    seconds = rng.uniform(0.1, 0.3, len(rows))
    energy = float(model.watts(rows) @ seconds)
    few, their = thinned(rows, seconds)
    assert len(few) < 2 * MOST_ROUTE_ROWS
    assert their.sum() == pytest.approx(seconds.sum())
    whole = energy_distribution(model, rows, seconds, energy)
    assert energy_distribution(model, few, their, energy).deviation_j == pytest.approx(
        whole.deviation_j, rel=0.01
    )


@pytest.fixture(scope="module")
def answer(model):
    """A short route over a slope, by a model with a covariance; and how often it was looked into.

    The battery holds what the route needs, and a little more.
    """
    asked = []

    def counted(*given):
        asked.append(given)
        return energy_distribution(*given)

    heights = 0.05 * np.arange(41)[None, :] * 0.25 + np.zeros((21, 1))
    certain = knowing(model, [ELECTRONICS, ROLLING], [[0.25, 0.0], [0.0, 1e-5]], run_gain=0.01)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(energy_account, "energy_distribution", counted)
        found = plan_route(
            terrain=terrain(heights),
            model=certain,
            start={"x": 1.0, "y": 2.5},
            goal={"x": 9.0, "y": 2.5},
        )
    return found, asked


def test_only_routes_that_are_answered_are_looked_into(answer):
    found, asked = answer
    before = len(asked)
    found.to_json()
    found.to_json()
    distinct = {id(r) for r in (*found.routes, *(b.route for b in found.baselines.values()))}
    assert before == 0
    assert len(asked) == len(distinct)


def test_a_route_tells_its_interval_its_chance_and_what_they_hang_on(answer):
    found, _ = answer
    route, document = found.routes[0], found.to_json()["routes"][0]
    low, high = document["energy_interval_j"]
    assert low < document["energy_j"] < high
    assert document["battery"]["chance"] == route.battery_chance
    assert route.battery_chance == route.distribution.chance(route.battery.available_j)
    told = {(part["effect"], part["parameter"]): part for part in document["sensitivity"]}
    assert set(told) == {
        ("electronics", "power"),
        ("wheel_rolling", "rolling"),
        ("noise", "one drive"),
    }
    electronics = told["electronics", "power"]
    assert electronics["joules_per_sd"] == pytest.approx(0.5 * route.duration_s, rel=1e-3)
    assert electronics["elasticity"] == pytest.approx(
        route.breakdown_j["electronics"] / route.energy_j, rel=1e-3
    )
    assert told["noise", "one drive"]["joules_per_sd"] == pytest.approx(
        0.01 * route.energy_j, rel=0.01
    )
