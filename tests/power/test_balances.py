"""Energy is neither made nor lost: balances, the second law, and the bound for search."""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.account import PER_WHEEL
from planner.power.catalogue import all_effects
from planner.power.kernel_math import SLIDING_SPEED
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from tests.power.states import Array, changed, column, model_with, random_columns

G = 9.80665
CANDIDATES = tuple(slug for slug, effect in all_effects().items() if not effect.base)


@pytest.fixture(scope="module")
def model() -> PowerModel:
    """Minibalance with load-dependent rolling and warm motors, all braking power accepted."""
    return model_with(
        "load_dependent_rolling",
        "motor_heating",
        load_dependent_rolling__exponent=0.4,
        regeneration_limit__source_share=1.0,
    )


@pytest.fixture(scope="module")
def rows() -> Array:
    """1,000 random states with acceleration, payload, shifted mass and temperature."""
    return rows_from(**random_columns(1000, seed=1))


def wheel_values(model: PowerModel, rows: Array) -> dict[str, Array]:
    """Per-wheel values of every row, each (rows, wheels)."""
    values = np.array([model.evaluate(row[None])[1] for row in rows])
    return {name: values[:, :, k] for k, name in enumerate(PER_WHEEL)}


def smooth_magnitude(speed: Array) -> Array:
    """|x| as the model's friction sees it: x·sgn(x) with the smooth sign."""
    return speed**2 / np.sqrt(speed**2 + SLIDING_SPEED**2)


def mass_of(rows: Array) -> Array:
    return 12.0 + column(rows, "payload")


def climbing(rows: Array) -> Array:
    """W that lifting the centre of mass takes; it stands at (com_x, com_y), not at the centre."""
    vx = column(rows, "vx") - column(rows, "wz") * column(rows, "com_y")
    vy = column(rows, "vy") + column(rows, "wz") * column(rows, "com_x")
    return -mass_of(rows) * (column(rows, "gravity_x") * vx + column(rows, "gravity_y") * vy)


def test_shaft_power_is_climbing_rolling_rollers_and_inertia(
    model: PowerModel, rows: Array
) -> None:
    wheels = wheel_values(model, rows)
    nominal = 12.0 * G / 4.0
    friction = wheels["load"] * (wheels["load"] / nominal) ** 0.4
    rolling = (0.035 * friction * smooth_magnitude(0.076 * wheels["wheel_speed"])).sum(axis=1)
    rollers = (0.045 * friction * smooth_magnitude(wheels["roller_speed"])).sum(axis=1)
    vx, vy, wz = (column(rows, name) for name in ("vx", "vy", "wz"))
    ax, ay = column(rows, "ax"), column(rows, "ay")
    body = mass_of(rows) * (
        ax * (vx - wz * column(rows, "com_y")) + ay * (vy + wz * column(rows, "com_x"))
    )
    turning = 1.01 * column(rows, "yaw_acceleration") * wz
    # Kinetic energy of one wheel changes by I·ω·dω/dt; r·dω/dt is the change of body velocity.
    levers = model.wheels[:, 2:5]
    change = np.stack([ax + wz * vy, ay - wz * vx, column(rows, "yaw_acceleration")], axis=1)
    spin_up = change @ levers.T / 0.076
    spinning = (0.0023 * wheels["wheel_speed"] * spin_up).sum(axis=1)

    parts = climbing(rows) + rolling + rollers + body + turning + spinning
    shaft = (wheels["wheel_torque"] * wheels["wheel_speed"]).sum(axis=1)
    scale = np.abs(climbing(rows)) + rolling + rollers + np.abs(body)
    assert np.all(np.abs(shaft - parts) <= 1e-9 * scale)
    assert np.all(np.abs(model.account(rows)["shaft"] - parts) <= 1e-9 * scale)


def test_terminal_power_is_voltage_times_current(model: PowerModel, rows: Array) -> None:
    wheels = wheel_values(model, rows)
    terminal = (wheels["voltage"] * wheels["current"]).sum(axis=1)
    scale = np.abs(wheels["voltage"] * wheels["current"]).sum(axis=1)
    assert np.all(np.abs(model.account(rows)["terminal"] - terminal) <= 1e-9 * scale)


@pytest.mark.parametrize(("faster", "tolerance"), [(1.0, 1e-3), (1e4, 1e-9)])
def test_terminal_power_is_shaft_copper_iron_and_gear(faster: float, tolerance: float) -> None:
    # Without inertia of the rotors, what is left between wheel and motor are teeth and iron. Signs
    # are smooth within 2 rad/s of the motor; at 10,000 times the speed nothing is left of that.
    model = changed(
        model_with("motor_heating"), inertia__rotor_inertia=0.0, viscous_drag__viscous_torque=3e-9
    )
    columns = random_columns(1000, seed=2) | {"ax": 0.0, "ay": 0.0}
    for name in ("vx", "vy", "wz"):
        columns[name] = columns[name] * faster
    rows = rows_from(**columns)
    wheels = wheel_values(model, rows)
    omega, torque = wheels["wheel_speed"], wheels["wheel_torque"]
    motor = 26.85 * omega
    turning = np.all(np.abs(motor) > 100.0, axis=1)
    assert turning.sum() > 250

    iron = 4.2e-3 * np.abs(motor) + 3e-9 * motor**2
    gear = 0.25 * np.abs(torque * omega)  # both ways: 1/0.8 - 1, and 1 - (2 - 1/0.8)
    copper = model.account(rows)["copper"]
    parts = (torque * omega + iron + gear).sum(axis=1) + copper
    scale = (np.abs(torque * omega) + iron).sum(axis=1) + copper
    terminal = model.account(rows)["terminal"]
    assert np.all(np.abs(terminal - parts)[turning] <= tolerance * scale[turning])


def test_parts_of_the_base_model_add_up(model: PowerModel, rows: Array) -> None:
    base = model.without_candidates()
    parts = base.watts_by_effect(rows)
    total = sum(parts[slug] for slug, effect in all_effects().items() if effect.base)
    scale = sum(np.abs(part) for part in parts.values())
    assert np.all(np.abs(total - base.watts(rows)) <= 1e-9 * scale)
    # Climbing is what gravity takes; the base model's mass stands in the middle.
    velocity = column(rows, "vx"), column(rows, "vy")
    height = mass_of(rows) * (
        -column(rows, "gravity_x") * velocity[0] - column(rows, "gravity_y") * velocity[1]
    )
    assert parts["gravity"] == pytest.approx(height, rel=1e-12)


def test_parts_of_all_effects_add_up(rows: Array) -> None:
    model = model_with(*CANDIDATES, wheel_imbalance__excess=0.0, surface_rolling__excess=0.3)
    parts = model.watts_by_effect(rows)
    assert set(parts) == set(all_effects())
    scale = sum(np.abs(part) for part in parts.values())
    assert np.all(np.abs(sum(parts.values()) - model.watts(rows)) <= 1e-9 * scale)


@pytest.fixture(scope="module")
def states() -> Array:
    """10,000 random states of steady motion on slopes up to 20°."""
    return rows_from(**random_columns(10_000, seed=3, moving=False))


def dissipation(model: PowerModel, states: Array) -> Array:
    """W that are lost: what the source gives less what height gains."""
    climb = -12.0 * (
        column(states, "gravity_x") * column(states, "vx")
        + column(states, "gravity_y") * column(states, "vy")
    )
    return model.watts(states) - climb


@pytest.mark.parametrize("source_share", [0.0, 1.0])
def test_dissipation_is_never_negative(states: Array, source_share: float) -> None:
    model = changed(model_with(), regeneration_limit__source_share=source_share)
    assert dissipation(model, states).min() >= 0.0


def test_dissipation_with_every_loss_that_the_catalogue_knows(states: Array) -> None:
    # Wind may push and is left still; gear_asymmetry must not make the teeth an energy source.
    model = model_with(*CANDIDATES, gear_asymmetry__return_change=0.5)
    still = states.copy()
    assert dissipation(model, still).min() >= 0.0


def test_admissible_bound_per_horizontal_metre(states: Array) -> None:
    # Electronics at the highest speed, the cheapest heading's friction, the drag of the motors;
    # 13.3 J/m in docs/physics.md, for up to 1.2 m/s and 20°.
    electronics = (2.5 + 4 * 0.2 + 2.0 + 0.02 * 10.0) / 0.88
    friction = min(0.035, 0.035 / np.sqrt(2.0) + 0.045) * 12.0 * G * np.cos(np.radians(20.0))
    motors = 4.0 / np.sqrt(2.0) * 26.85 * 4.2e-3 / 0.076
    bound = electronics / 1.2 + friction + motors
    assert bound == pytest.approx(13.3, abs=0.05)

    model = changed(model_with(), regeneration_limit__source_share=1.0)
    vx, vy = column(states, "vx"), column(states, "vy")
    rise = -(column(states, "gravity_x") * vx + column(states, "gravity_y") * vy) / G
    horizontal = np.sqrt(vx**2 + vy**2 - rise**2)
    assert np.all(dissipation(model, states) / horizontal >= bound)


def test_without_losses_height_is_all_that_costs() -> None:
    model = changed(
        model_with(),
        electronics__power=0.0,
        wheel_rolling__rolling=0.0,
        roller_drag__roller=0.0,
        gear_loss__efficiency=1.0,
        copper_loss__resistance=1e-12,
        coulomb_drag__coulomb_torque=0.0,
        viscous_drag__viscous_torque=0.0,
        driver_loss__bridge_resistance=0.0,
        driver_loss__switching_power=0.0,
        sensor_rate__energy_per_sample=0.0,
        regeneration_limit__source_share=1.0,
    )
    columns = random_columns(200, seed=4, moving=False)
    up = rows_from(**columns)
    down = rows_from(**{**columns, "vx": -columns["vx"], "vy": -columns["vy"]})
    assert model.watts(up) == pytest.approx(climbing_centred(up), abs=1e-9)
    assert model.watts(up) + model.watts(down) == pytest.approx(np.zeros(200), abs=1e-9)


def climbing_centred(rows: Array) -> Array:
    return -12.0 * (
        column(rows, "gravity_x") * column(rows, "vx")
        + column(rows, "gravity_y") * column(rows, "vy")
    )


def test_mirrored_motion_costs_the_same(model: PowerModel) -> None:
    columns = random_columns(300, seed=5)
    odd = ("vy", "wz", "ay", "yaw_acceleration", "gravity_y", "com_y", "wind_y")
    mirrored = {name: -value if name in odd else value for name, value in columns.items()}
    assert model.watts(rows_from(**mirrored)) == pytest.approx(
        model.watts(rows_from(**columns)), rel=1e-9
    )


def test_more_payload_costs_more(model: PowerModel) -> None:
    loads = rows_from(vx=0.5, gravity_x=-1.0, payload=np.linspace(0.0, 30.0, 7))
    assert np.all(np.diff(model.watts(loads)) > 0.0)
