"""What each effect is worth on minibalance, against the sizes listed in docs/physics.md.

Sizes there are estimates to one or two digits; the ranges here are theirs.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.catalogue import all_effects
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from planner.power.vehicles import load_vehicle
from tests.power.states import Array, model_with, plane_gravity


def flat(**more: float) -> Array:
    return rows_from(**{"vx": 0.5, **more})


def uphill(degrees: float = 10.0, **more: float) -> Array:
    return rows_from(**{"vx": 0.5, **more}, **plane_gravity(np.radians(degrees), 0.0))


def worth(slug: str, rows: Array, **values: float) -> float:
    """W that the effect adds at the supply, beside all others that act."""
    model = model_with(slug, **{f"{slug}__{name}": value for name, value in values.items()})
    without = model
    for place, (effect, _, parameter, _) in enumerate(model.slots):
        if effect.slug == slug and parameter.null is not None:
            without = without.with_parameter(place, parameter.null)
    return float((model.watts(rows) - without.watts(rows))[0])


@pytest.mark.parametrize(
    ("slug", "rows", "values", "low", "high"),
    [
        # Σ b·ω² is 0.29 W at 0.5 m/s and 0.73 W at 0.8 m/s, the current for it comes on top.
        ("viscous_drag", flat(), {}, 0.29, 0.4),
        ("viscous_drag", flat(vx=0.8), {}, 0.73, 0.9),
        ("driver_loss", flat(), {}, 0.58, 0.62),
        ("converter_efficiency", flat(), {}, 0.78, 0.85),
        # ρ = 0.5: a quarter of the copper loss.
        ("current_ripple", flat(), {"ripple_squared": 0.25}, 0.18, 0.22),
        ("current_ripple", uphill(), {"ripple_squared": 0.25}, 1.85, 2.05),
        ("battery_sag", flat(), {}, 0.02, 0.03),
        # Creep of 1-3 % on the slope.
        ("wheel_slip", uphill(), {"creep": 0.02}, 0.1, 0.4),
        ("wheel_slip", uphill(), {"creep": 0.05}, 0.1, 0.5),
        ("vibration", flat(), {}, 0.1, 0.5),
        ("light_load_gear_drag", flat(), {}, 0.3, 0.8),
        ("cold_grease", flat(motor_temp=-10.0), {"viscosity": 2.3e-6}, 0.5, 1.1),
        # Soft ground adds 5-20 W.
        ("sinkage", flat(), {}, 4.5, 20.0),
        # Wind of 5 m/s from ahead at 0.8 m/s: 2.9 W at the wheels, more through gear and motor.
        ("air_drag", flat(vx=0.8, wind_x=-5.0), {}, 2.9 / 0.8, 2.9 / 0.6),
    ],
)
def test_size(slug: str, rows: Array, values: dict[str, float], low: float, high: float) -> None:
    assert low <= worth(slug, rows, **values) <= high


def test_twice_the_mass_rolls_twice_as_badly() -> None:
    # κ = 1: c·N goes with the square of the load, so 24 kg roll four times as hard as 12 kg.
    model = model_with("load_dependent_rolling", load_dependent_rolling__exponent=1.0)
    shaft = model.account(rows_from(vx=0.5, payload=[0.0, 12.0]))["shaft"]
    assert shaft[1] / shaft[0] == pytest.approx(4.0, rel=1e-9)


def test_sampling_twice_as_often() -> None:
    # 25 Hz to 50 Hz: 25·0.02 J behind a converter of 0.88.
    watts = model_with().watts(rows_from(vx=0.5, sensor_rate=[25.0, 50.0]))
    assert watts[1] - watts[0] == pytest.approx(25.0 * 0.02 / 0.88, rel=1e-9)


def test_sampling_faster_with_speed() -> None:
    # 0.45 W at 0.5 m/s: 40·0.5 more samples a second.
    rise = worth("sensor_rate", flat()) - worth("sensor_rate", flat(vx=0.0))
    assert rise == pytest.approx(40.0 * 0.5 * 0.02 / 0.88, rel=1e-9)


def test_carpet() -> None:
    # c_w from 0.035 to 0.08: 2.65 W of rolling, 3.3 W behind the gear, and the current for it.
    model = model_with("surface_rolling", surface_rolling__excess=0.08 / 0.035 - 1.0)
    hard, carpet = model.account(rows_from(vx=0.5, surface=[-1.0, 1.0]))["shaft"]
    assert carpet - hard == pytest.approx(0.045 * 12.0 * 9.80665 * 0.5, rel=1e-4)
    watts = model.watts(rows_from(vx=0.5, surface=[-1.0, 1.0]))
    assert 3.3 < watts[1] - watts[0] < 5.0


def test_sag_at_70_watts() -> None:
    # I = 70/25.2 = 2.8 A without sag: 0.6 W in 0.08 Ω.
    effect = all_effects()["battery_sag"].hooks["supply"]
    lost = effect(70.0, float("nan"), 0.08, 25.2)
    assert lost == pytest.approx(0.63, rel=0.02)
    # and 0.5 % more is drawn at 40 W, 2 % at 150 W.
    for watts, share in ((40.0, 0.005), (150.0, 0.02)):
        assert effect(watts, float("nan"), 0.08, 25.2) / watts == pytest.approx(share, abs=0.0005)


def test_scrub_is_a_moment_times_the_yaw_rate() -> None:
    model = model_with("yaw_scrub", yaw_scrub__scrub_moment=3.5)
    bare = model_with().account(rows_from(wz=[0.5, 1.0]))["shaft"]
    shaft = model.account(rows_from(wz=[0.5, 1.0]))["shaft"]
    assert shaft - bare == pytest.approx([1.75, 3.5], rel=1e-3)


def test_slope_edge_of_ten_degrees() -> None:
    # Over one wheelbase of 0.43 m at 0.5 m/s the slope changes by 10° in 0.86 s.
    rate = np.radians(10.0) / 0.86
    model = model_with("slope_transition", slope_transition__transition_drag=5.0)
    shaft = model.account(rows_from(vx=0.5, slope_rate=[0.0, rate]))["shaft"]
    assert shaft[1] - shaft[0] == pytest.approx(5.0 * rate * 0.5, rel=1e-3)


def test_stiction_is_gone_in_motion() -> None:
    model = model_with("stiction", stiction__strength=1.0, stiction__stiction_speed=0.03)
    shares = model.watts_by_effect(rows_from(vx=[0.03, 0.3]))["stiction"]
    assert shares[0] > 0.01
    assert abs(shares[1]) < 1e-9
    # Turning on the spot at speed is not standstill, though the centre rests.
    assert abs(model.watts_by_effect(rows_from(wz=2.0))["stiction"][0]) < 1e-9


def test_presliding_is_the_mean_of_friction_that_builds_up_over_a_path() -> None:
    rim, spin, share = 0.4, -0.09, 0.15
    # Over a contact the roller is carried by spin/rim, in distances between two rollers.
    way = np.linspace(0.0, abs(spin) / rim, 20_001)
    built_up = np.trapezoid(1.0 - np.exp(-way / share), way) / way[-1]
    factor = all_effects()["roller_presliding"].hooks["roller_factor"]
    assert factor(rim, spin, share) == pytest.approx(built_up, rel=2e-3)
    # Straight ahead next to nothing is left, sideways of the rim nearly all.
    assert factor(rim, 0.0, share) < 0.05
    assert factor(0.01, 0.4, share) > 0.99


def test_presliding_rounds_the_dip_of_power_where_a_roller_stands() -> None:
    # On omni wheels one roller stands at 90°; complete friction jumps within a degree of it.
    vehicle = load_vehicle("robotino")
    angle = np.radians([90.0, 92.0, 95.0, 100.0, 110.0])
    rows = rows_from(vx=0.2 * np.cos(angle), vy=0.2 * np.sin(angle))
    model = PowerModel.from_vehicle(vehicle, effects=["roller_presliding"])
    place = next(k for k, slot in enumerate(model.slots) if slot[1] == "presliding")
    sharp = np.diff(model.with_parameter(place, 0.0).account(rows)["bus"])
    round_ = np.diff(model.with_parameter(place, 0.15).account(rows)["bus"])
    assert sharp[0] > 0.5 * sharp.sum()
    assert 0.0 < round_[0] < 0.2 * sharp[0]


def test_cold_grease_falls_and_heat_rises_with_temperature() -> None:
    temperatures = rows_from(vx=0.5, motor_temp=np.linspace(-10.0, 80.0, 10))
    grease = model_with("cold_grease").watts_by_effect(temperatures)["cold_grease"]
    heat = model_with("motor_heating").watts_by_effect(temperatures)["motor_heating"]
    assert np.all(np.diff(grease) < 0.0)
    assert np.all(np.diff(heat) > 0.0)


def test_aliases_have_the_same_shape() -> None:
    # Where the catalogue says that two effects are one, their shares are in proportion.
    rows = rows_from(vx=np.linspace(0.3, 1.0, 8))
    bare = model_with()
    ripple = model_with("current_ripple", current_ripple__ripple_squared=0.1).watts(rows)
    resistance = next(k for k, slot in enumerate(bare.slots) if slot[1] == "resistance")
    thicker = bare.with_parameter(resistance, 1.1 * bare.parameters[resistance]).watts(rows)
    assert ripple == pytest.approx(thicker, rel=1e-12)

    shaking = model_with("vibration").account(rows)["shaft"] - model_with().account(rows)["shaft"]
    rolling = shaking / np.linspace(0.3, 1.0, 8)
    assert np.ptp(rolling) < 1e-3 * np.max(rolling)


def test_the_share_of_an_effect_beside_others_is_what_the_power_lacks_without_it() -> None:
    rows = rows_from(vx=[0.3, 0.6, -0.5], wz=[0.0, 0.4, 0.8])
    model = model_with("air_drag", "yaw_scrub")
    for slug, other in (("air_drag", "yaw_scrub"), ("yaw_scrub", "air_drag")):
        alone = model_with(other)
        share = model.share_of(slug, rows)
        assert share == pytest.approx(model.watts(rows) - alone.watts(rows), abs=1e-9)
        assert np.all(share[1:] > 0.0)
    # Straight on, nothing scrubs.
    assert model.share_of("yaw_scrub", rows)[0] == 0.0
