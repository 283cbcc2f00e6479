"""Centre of mass off the centre: it causes unequal wheel loads, and a yaw moment on slopes.

    known     x_c = gain·com_x,  y_c = gain·com_y
    unknown   x_c = offset_x ± √(offset_x²),  y_c = offset_y ± √(offset_y²)

Sign
    com_x forward, com_y left; loads rise on the side of the offset. Single motors may need less; on
    flat ground an offset costs power in total. If the column is missing, offset_x and offset_y are
    constant; slopes and turns show their side. Straight drives on flat ground show only how large
    an offset is: to either side, the power is the mean over both. It then depends only on the
    square of the offset. The square is therefore a parameter of its own: its derivative at the null
    value is finite and not zero.
Source
    exact statics of a rigid body on equal springs (planner.power.kinematics); gain = 1 is the
    physics, gain = 0 the model with the mass in the middle.
Holds for
    offsets inside the wheels' polygon; com_x and com_y are of robot and payload together.
Left out
    sloshing or swinging loads.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import known, root

_TINY = 1e-4  # m; at this size only the side of an offset shows, and its square hardly
_OFFSETS = {"offset_x": -0.07, "offset_y": 0.3}  # of the examples
_SQUARES = {"offset_x_squared": 0.01, "offset_y_squared": 0.0025}


class ComOffset(Effect):
    """Position of the centre of mass."""

    slug = "com_offset"
    title = "centre of mass off the centre"
    how_to_measure = "Carry a load off the centre, with columns com_x and com_y."

    gain = Parameter(unit="1", default=1.0, null=0.0, bounds=(-1.0, 3.0), spread=0.1)
    """Factor on the given centre of mass; 1 is exact statics."""
    offset_x = Parameter(
        unit="m", default=0.0, null=0.0, bounds=(-2.0, 2.0), spread=1.0, tried_at=_TINY
    )
    """Offset forward where com_x is not known."""
    offset_y = Parameter(
        unit="m", default=0.0, null=0.0, bounds=(-2.0, 2.0), spread=1.0, tried_at=_TINY
    )
    """Offset to the left where com_y is not known."""
    offset_x_squared = Parameter(unit="m²", default=0.0, null=0.0, bounds=(0.0, 4.0), spread=1.0)
    """Square of a further offset, forward or backward, where com_x is not known."""
    offset_y_squared = Parameter(unit="m²", default=0.0, null=0.0, bounds=(0.0, 4.0), spread=1.0)
    """Square of a further offset, to the left or right, where com_y is not known."""

    @staticmethod
    def centre_of_mass(com_x, com_y, gain, offset_x, offset_y):
        """m, forward and left of the geometric centre."""
        x = gain * com_x if known(com_x) else offset_x
        y = gain * com_y if known(com_y) else offset_y
        return x, y

    @staticmethod
    def centre_spread(com_x, com_y, offset_x_squared, offset_y_squared):
        """m, along each axis, to an unknown side."""
        x = 0.0 * offset_x_squared if known(com_x) else root(offset_x_squared)
        y = 0.0 * offset_y_squared if known(com_y) else root(offset_y_squared)
        return x, y

    examples = (
        WorkedExample(
            "centre_of_mass",
            {"com_x": -0.1, "com_y": 0.04, "gain": 0.5, **_OFFSETS},
            (-0.05, 0.02),
            "half of the given offset",
        ),
        WorkedExample(
            "centre_of_mass",
            {"com_x": float("nan"), "com_y": 0.04, "gain": 0.5, **_OFFSETS},
            (-0.07, 0.02),
            "x is not known; half of the given y",
        ),
        WorkedExample(
            "centre_spread",
            {"com_x": float("nan"), "com_y": 0.04, **_SQUARES},
            (0.1, 0.0),
            "√0.01; y is known",
        ),
        WorkedExample(
            "centre_spread",
            {"com_x": -0.1, "com_y": float("nan"), **_SQUARES},
            (0.0, 0.05),
            "x is known; √0.0025",
        ),
    )
