"""Names of the numbers that the compiled power model reads and writes beside its rows.

    body        (len(Body),) read: mass and geometry
    account     (ACCOUNT_LENGTH,) written: sums, limits and the watts of every base effect
    per_wheel   (n, len(PerWheel)) written: what each wheel carries and draws

Compiled loops read the lengths as constants; ``PowerModel.account`` gives the columns by name.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal


class Body(IntEnum):
    """Columns of ``body``."""

    MASS = 0  # kg, without payload
    CENTRE_HEIGHT = 1  # m, centre of mass above ground
    WHEEL_RADIUS = 2  # m
    GEAR_RATIO = 3  # 1, motor speed over wheel speed
    TRACTION = 4  # 1, largest axle force over load


class PerWheel(IntEnum):
    """Columns of ``per_wheel``."""

    LOAD = 0  # N
    ROLLING_FACTOR = 1  # 1, on rolling and roller drag
    ROLLER_FORCE = 2  # N, along the roller's free direction
    WHEEL_SPEED = 3  # rad/s
    ROLLER_SPEED = 4  # m/s
    AXIS_FORCE = 5  # N, along the roller's axle
    WHEEL_TORQUE = 6  # N·m, at the hub
    MOTOR_TORQUE = 7  # N·m, inside the motor
    CURRENT = 8  # A
    VOLTAGE = 9  # V
    MOTOR_WATTS = 10  # W, at the motor's terminals


class Account(IntEnum):
    """Columns of ``account`` before those of the base effects."""

    # W, parts of the balance
    SUPPLY = 0
    BUS = 1
    TERMINAL = 2
    SHAFT = 3
    COPPER = 4
    DRIVER = 5
    ELECTRONICS = 6
    # what limits are set for
    LEAST_LOAD = 7  # N
    CURRENT = 8  # A
    VOLTAGE = 9  # V
    MOTOR_TORQUE = 10  # N·m
    TRACTION_LEFT = 11  # 1, share of the traction limit


PER_WHEEL = tuple(column.name.lower() for column in PerWheel)
ACCOUNT = tuple(column.name.lower() for column in Account)
BASE_EFFECTS = (
    *("electronics", "gravity", "inertia", "wheel_rolling", "roller_drag", "gear_loss"),
    *("copper_loss", "coulomb_drag"),
)
"""Slugs of the base model's effects, in the order of their columns."""
ACCOUNT_LENGTH = len(ACCOUNT) + len(BASE_EFFECTS)
"""Behind the named columns follow the watts of the base effects, each by its own balance."""
LIMITS = {
    "least_load": "least_load",
    "current": "most_current",
    "voltage": "most_voltage",
    "motor_torque": "most_torque",
    "traction_left": "traction_left",
}
"""Columns of ACCOUNT that limits are set for → the variable that holds each in the kernel."""
Output = Literal["account", "power", "limits"]
"""What a kernel writes: the account of one row; or, of a block of rows, the power, or the power and
behind it the LIMITS, one stretch of BLOCK numbers each."""
