"""Columns of the arrays that the compiled power model reads and writes in addition to its rows.

    body        (len(Body),) read: mass, geometry and what a second is worth
    account     (ACCOUNT_LENGTH,) written: sums, limits and the watts of every base effect
    per_wheel   (n, len(PerWheel)) written: what each wheel carries and draws

Compiled loops read the lengths as constants; ``PowerModel.account`` gives the columns by name.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal

Body = IntEnum(
    "Body",
    "MASS CENTRE_HEIGHT WHEEL_RADIUS GEAR_RATIO TRACTION SLIDING_SPEED TIME_WEIGHT",
    start=0,
)
"""Columns of ``body``: kg without payload, m above ground, m, 1, largest axle force/load, and m/s
within which friction of rims and rollers changes sign."""
PerWheel = IntEnum(
    "PerWheel",
    "LOAD ROLLING_FACTOR ROLLER_FORCE WHEEL_SPEED ROLLER_SPEED AXIS_FORCE WHEEL_TORQUE MOTOR_TORQUE"
    " CURRENT VOLTAGE MOTOR_WATTS GEAR_TORQUE",
    start=0,
)
"""Columns of ``per_wheel``: N, 1 (on all rolling drag), N, rad/s, m/s, N, N·m, N·m, A, V, W; N·m at
the motor that the gear takes, of an unknown circulation the worse side."""
Account = IntEnum(
    "Account",
    "SUPPLY BUS TERMINAL SHAFT COPPER DRIVER ELECTRONICS"
    " LEAST_LOAD CURRENT VOLTAGE MOTOR_TORQUE TRACTION_LEFT",
    start=0,
)
"""First columns of ``account``: seven powers in W; N, A, V, N·m, share of traction left."""
PER_WHEEL = tuple(column.name.lower() for column in PerWheel)
ACCOUNT = tuple(column.name.lower() for column in Account)
BASE_EFFECTS = (
    *("electronics", "gravity", "inertia", "wheel_rolling", "roller_drag", "gear_loss"),
    *("copper_loss", "coulomb_drag"),
)
"""Slugs of the base model's effects, in the order of their columns."""
ACCOUNT_LENGTH = len(ACCOUNT) + len(BASE_EFFECTS)
"""The watts of the base effects follow the named columns, each by its own balance."""
LIMITS = {
    "least_load": "least_load",
    "current": "most_current",
    "voltage": "most_voltage",
    "motor_torque": "most_torque",
    "traction_left": "traction_left",
}
"""Columns of ACCOUNT that have limits, side by side → the variable of each in the stages."""
Output = Literal["account", "power", "limits"]
"""What a kernel writes: the account of one row; or, of a block of rows, the power, or the power and
behind it the LIMITS, one stretch of BLOCK numbers each."""
