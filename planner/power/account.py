"""Names of the numbers that the compiled power model reads and writes beside its rows.

    body        (len(BODY),) read: mass and geometry
    account     (ACCOUNT_LENGTH,) written: sums, limits and the watts of every base effect
    per_wheel   (n, len(PER_WHEEL)) written: what each wheel carries and draws

Compiled loops read the lengths as constants; ``PowerModel.account`` gives the columns by name.
"""

from __future__ import annotations

from typing import Literal

BODY = ("mass", "centre_height", "wheel_radius", "gear_ratio", "traction")
PER_WHEEL = (
    *("load", "wheel_speed", "roller_speed", "axis_force", "wheel_torque", "motor_torque"),
    *("current", "voltage", "motor_watts"),
)
ACCOUNT = (
    # W; parts of the balance
    *("supply", "bus", "terminal", "shaft", "copper", "driver", "electronics"),
    # limits: N, A, V, N·m, share of the traction limit that is left
    *("least_load", "current", "voltage", "motor_torque", "traction_left"),
)
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
