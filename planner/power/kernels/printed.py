"""The source paper's motor power as it is printed, with all that is wrong with it.

    P_motor = P_copper + P_iron + P_mechanical + P_friction

    P_copper     = τ·F² + k(T) + β(T)·t
    P_iron       = λ1·a·Σv_i + λ2·t·a·v² + λ3·t²·a·v²
    P_mechanical = k1·F² + k2·v·F
    P_friction   = μ1·cosθ·Σ N_i·v_i + μ2·cosθ·cosγ·N·v
    F            = m·g·sinθ·sinγ + μ·m·g·cosγ

Sign
    as printed: cosθ and sinθ are signed, so that friction can give power back and gravity can pull
    the wrong way; nothing here keeps the dissipation positive. The paper prints the climb only; γ
    is taken as negative when the robot loses height.
Readings
    A: θ from the robot's front, so that forward is 0 and left 90°. B: θ from its left side, so that
    left is 0 and forward 90°. B makes gravity act uphill and the roller term act sideways.
Source
    FCEPM paper, sections 2 and 3, with Table 1 for k1 and k2 (whose caption calls them friction
    constants). The text gives no values for τ, λ, k(T), β(T); τ is taken equal to k1, the same
    copper law, the others as 0. μ1 and μ2 are not given either and are the vehicle's rolling and
    roller coefficients, as is μ = μ1.
Holds for
    comparison with the sound model, not for planning: docs/physics.md goes through it line by line.
Left out
    control and sensing, whose equations are not in the text; the sound ones stand in.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.compiled_code import njit

FORCE_SQUARED = 0.0022
"""W/N², k1: mean of Table 1."""
FORCE_SPEED = 1.53
"""1, k2: mean of Table 1, the inverse of a total efficiency of 0.65."""
COPPER = 0.0022
"""W/N², τ: the paper gives no value, so k1 stands in."""


@njit(cache=True)
def printed_direction(vx: float, vy: float, reading_b: bool) -> Any:
    """Cosine and sine of the printed θ for a body velocity in m/s; forward at rest."""
    speed = np.sqrt(vx * vx + vy * vy)
    along, across = (vx / speed, vy / speed) if speed > 0.0 else (1.0, 0.0)
    return (across, along) if reading_b else (along, across)


@njit(cache=True)
def printed_forces(
    mass: Any,
    gravity_x: float,
    gravity_y: float,
    gravity_normal: float,
    vx: float,
    vy: float,
    sine: float,
    friction: Any,
) -> Any:
    """F_gravity and F_friction in N.

    Args:
        mass: kg with payload.
        gravity_x, gravity_y, gravity_normal: m/s² in the body frame, see planner.quantities.
        vx, vy: m/s in the body frame; decide whether the slope counts as up or down.
        sine: sinθ of the reading.
        friction: μ.
    """
    steep = np.sqrt(gravity_x * gravity_x + gravity_y * gravity_y)
    if gravity_x * vx + gravity_y * vy > 0.0:
        steep = -steep
    return mass * sine * steep, friction * mass * gravity_normal


@njit(cache=True)
def printed_watts(
    force: Any,
    speed: float,
    cosine: float,
    cos_slope: float,
    load_times_speed: Any,
    load: Any,
    friction_1: Any,
    friction_2: Any,
) -> Any:
    """Copper, mechanical and friction power in W, in this order; iron is 0.

    Args:
        force: F in N.
        speed: v in m/s.
        cosine, cos_slope: cosθ of the reading, cosγ.
        load_times_speed: Σ N_i·v_i in W.
        load: N in N.
        friction_1, friction_2: μ1 and μ2.
    """
    copper = COPPER * force * force
    mechanical = FORCE_SQUARED * force * force + FORCE_SPEED * speed * force
    rubbing = friction_1 * load_times_speed * cosine
    rubbing += friction_2 * load * speed * cosine * cos_slope
    return copper, mechanical, rubbing
