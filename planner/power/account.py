"""Names of the numbers that the compiled power model reads and writes beside its rows.

    body        (len(Body),) read: mass and geometry
    account     (ACCOUNT_LENGTH,) written: sums, limits and the watts of every base effect
    per_wheel   (n, len(PerWheel)) written: what each wheel carries and draws

Compiled loops read the lengths as constants; ``PowerModel.account`` gives the columns by name.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal

# mypy and the kernels' pass read these names as the numbers of columns.
Body = IntEnum("Body", "MASS CENTRE_HEIGHT WHEEL_RADIUS GEAR_RATIO TRACTION", start=0)
"""kg without payload, m above ground, m, motor speed over wheel speed, axle force over load."""
PerWheel = IntEnum(
    "PerWheel",
    "LOAD ROLLING_FACTOR ROLLER_FORCE WHEEL_SPEED ROLLER_SPEED AXIS_FORCE WHEEL_TORQUE MOTOR_TORQUE"
    " CURRENT VOLTAGE MOTOR_WATTS",
    start=0,
)
"""N, 1 on rolling and roller drag, N, rad/s, m/s, N, N·m, N·m, A, V, W at the motor's terminals."""
Account = IntEnum(
    "Account",
    "SUPPLY BUS TERMINAL SHAFT COPPER DRIVER ELECTRONICS"
    " LEAST_LOAD CURRENT VOLTAGE MOTOR_TORQUE TRACTION_LEFT",
    start=0,
)
"""W, the parts of the balance; then N, A, V, N·m, share of the traction limit that is left."""
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
