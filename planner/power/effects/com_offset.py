"""Centre of mass off the centre: unequal wheel loads, and a yaw moment on slopes.

    x_c = gain·com_x,  y_c = gain·com_y

Sign
    forward and left are positive; loads rise on the side of the offset. The power can rise or fall
    at single wheels, and rises in sum on the flat.
Source
    exact statics of a rigid body on equal springs (planner.power.kinematics); gain = 1 is the
    physics, gain = 0 the model with the mass in the middle.
Holds for
    offsets inside the wheels' polygon; com_x and com_y are of robot and payload together.
Left out
    sloshing or swinging loads. Nothing where the columns are not known.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import known


class ComOffset(Effect):
    """Position of the centre of mass."""

    slug = "com_offset"
    title = "centre of mass off the centre"

    gain = Parameter(
        unit="1",
        default=1.0,
        null=0.0,
        bounds=(-1.0, 3.0),
        doc="Factor on the given centre of mass; 1 is exact statics.",
        spread=0.1,
    )

    @staticmethod
    def centre_of_mass(com_x, com_y, gain):
        """m, forward and left of the geometric centre."""
        x = com_x if known(com_x) else 0.0
        y = com_y if known(com_y) else 0.0
        return gain * x, gain * y

    examples = (
        WorkedExample(
            "centre_of_mass",
            {"com_x": -0.1, "com_y": 0.04, "gain": 0.5},
            (-0.05, 0.02),
            "half of the given offset",
        ),
    )
