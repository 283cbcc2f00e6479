"""The compiled model against ``tests.power.reference``, which was written apart from it.

The reference has sharp friction signs, the model smooth ones (5 mm/s at the rim, 2 rad/s at the
motor). Realistic states are therefore compared away from standstill, to the tolerance that the
smoothing leaves; and the same states 10,000 times faster, where it is gone, to rounding.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.account import PER_WHEEL
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from tests.power.reference import Answer, Robot, State, evaluate, gravity_on
from tests.power.states import Array, changed, model_with

COUNT = 1000
EXPONENT = 0.4


def random_states(faster: float) -> list[State]:
    """States on real slopes with offsets, payload, acceleration and temperature."""
    random = np.random.default_rng(6)
    states: list[State] = []
    while len(states) < COUNT:
        velocity = random.uniform((-1.2, -1.2, -1.0), (1.2, 1.2, 1.0))
        steepness, direction = random.uniform(0.0, 0.36), random.uniform(-np.pi, np.pi)
        state = State(
            velocity=tuple(faster * velocity),
            gravity=gravity_on(
                steepness * np.cos(direction),
                steepness * np.sin(direction),
                random.uniform(-np.pi, np.pi),
            ),
            acceleration=tuple(random.uniform(-0.5, 0.5, 3)),
            offset=tuple(random.uniform(-0.04, 0.04, 2)),
            payload=random.uniform(0.0, 10.0),
            winding_temp=random.uniform(-10.0, 90.0),
        )
        if np.abs(rims_and_rollers(velocity)).min() > 0.25:
            states.append(state)
    return states


def rims_and_rollers(velocity: Array) -> Array:
    """m/s of the four rims and rollers of minibalance."""
    vx, vy, wz = velocity
    lever = 0.461 * wz
    rims = [vx - vy - lever, vx + vy + lever, vx + vy - lever, vx - vy + lever]
    return np.array([*rims, vy + 0.214 * wz, vy - 0.214 * wz])


def rows_of(states: list[State]) -> Array:
    """The same states as rows of the model."""

    def values(name: str, index: int) -> Array:
        return np.array([getattr(state, name)[index] for state in states])

    return rows_from(
        vx=values("velocity", 0),
        vy=values("velocity", 1),
        wz=values("velocity", 2),
        ax=values("acceleration", 0),
        ay=values("acceleration", 1),
        yaw_acceleration=values("acceleration", 2),
        gravity_x=values("gravity", 0),
        gravity_y=values("gravity", 1),
        gravity_normal=values("gravity", 2),
        com_x=values("offset", 0),
        com_y=values("offset", 1),
        payload=np.array([state.payload for state in states]),
        motor_temp=np.array([state.winding_temp for state in states]),
    )


def answers(robot: Robot, states: list[State]) -> dict[str, Array]:
    """All answers of the reference, arrays over the states."""
    found: list[Answer] = [evaluate(robot, state) for state in states]
    return {name: np.array([getattr(a, name) for a in found]) for name in vars(found[0])}


@pytest.fixture(scope="module")
def model() -> PowerModel:
    """Everything that the reference knows, magnets as warm as the windings are not."""
    return model_with(
        "load_dependent_rolling",
        "motor_heating",
        "air_drag",
        load_dependent_rolling__exponent=EXPONENT,
        motor_heating__magnet_share=0.0,
        roller_drag__roller_viscous=2.0,
    )


def per_wheel(model: PowerModel, rows: Array) -> dict[str, Array]:
    values = np.array([model.evaluate(row[None])[1] for row in rows])
    return {name: values[:, :, k] for k, name in enumerate(PER_WHEEL)}


def test_realistic_states(model: PowerModel) -> None:
    states = random_states(1.0)
    expected = answers(Robot(exponent=EXPONENT, drag_area=0.18, roller_viscous=2.0), states)
    rows = rows_of(states)
    account = model.account(rows)
    scale = np.abs(expected["shaft"]) + expected["copper"] + expected["iron"]
    for name in ("terminal", "shaft", "copper"):
        assert np.all(np.abs(account[name] - expected[name]) <= 2e-3 * scale), name
    assert np.all(np.abs(model.watts(rows) - expected["supply"]) <= 2e-3 * scale)
    wheels = per_wheel(model, rows)
    assert wheels["load"] == pytest.approx(expected["load"], rel=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.7])
def test_fast_states_to_rounding(model: PowerModel, share: float) -> None:
    # At this speed viscous terms and the turning wheels' inertia would swamp all others.
    slow = changed(
        model,
        inertia__wheel_inertia=0.0,
        inertia__rotor_inertia=0.0,
        viscous_drag__viscous_torque=2e-10,
        roller_drag__roller_viscous=1e-4,
        air_drag__drag_area=2e-9,
        regeneration_limit__source_share=share,
    )
    states = random_states(1e4)
    robot = Robot(
        exponent=EXPONENT,
        viscous=2e-10,
        roller_viscous=1e-4,
        drag_area=2e-9,
        source_share=share,
        wheel_inertia=0.0,
        rotor=0.0,
    )
    expected = answers(robot, states)
    rows = rows_of(states)
    wheels = per_wheel(slow, rows)
    for name, column in (("load", "load"), ("torque", "wheel_torque"), ("current", "current")):
        scale = np.abs(expected[name]).max(axis=1, keepdims=True)
        assert np.all(np.abs(wheels[column] - expected[name]) <= 1e-8 * scale), name
    account = slow.account(rows)
    scale = np.abs(expected["shaft"]) + expected["copper"] + expected["iron"] + expected["gear"]
    for name in ("terminal", "shaft", "copper", "supply"):
        assert np.all(np.abs(account[name] - expected[name]) <= 1e-8 * scale), name
    assert np.any(expected["supply"] < 0.0) == (share > 0.0)


def test_reference_keeps_its_own_balance() -> None:
    # An oracle has to be right by itself: shaft, copper, iron and gear make the terminal power.
    states = random_states(1.0)
    robot = Robot(exponent=EXPONENT)
    expected = answers(robot, states)
    parts = sum(expected[name] for name in ("shaft", "copper", "iron", "gear"))
    rotors = np.array([rotor_watts(robot, state) for state in states])
    assert expected["terminal"] == pytest.approx(parts + rotors, rel=1e-12)
    assert expected["load"].sum(axis=1) == pytest.approx(
        [(12.0 + s.payload) * s.gravity[2] for s in states], rel=1e-12
    )


def rotor_watts(robot: Robot, state: State) -> float:
    """W that speed up the four rotors."""
    vx, vy, wz = state.velocity
    ax, ay, alpha = state.acceleration
    change = np.array([ax + wz * vy, ay - wz * vx, alpha])
    total = 0.0
    for roller, yaw in ((-1, -1), (1, 1), (1, -1), (-1, 1)):
        axis = np.array([1.0, roller, 0.461 * yaw])
        total += (axis @ change) * (axis @ [vx, vy, wz])
    return float(total * robot.rotor * (robot.ratio / robot.radius) ** 2)
