"""Gravity: the component of the weight along the surface.

    F = -m·g_body        M = x_c·F_y - y_c·F_x

Sign
    the force that the wheels must supply, so positive uphill. Its power is m·g·dz/dt: spent uphill,
    returned downhill. It is an exchange with height, not a loss.
Source
    exact projection on the body axes of the surface, no small angles.
Holds for
    a rigid body on the plane through its wheel contacts.
Left out
    changes of the body's attitude by a soft suspension.
"""

from planner.power.effect import Effect, WorkedExample


class Gravity(Effect):
    """Weight along the slope."""

    slug = "gravity"
    title = "climbing"
    base = True
    exchange = True

    @staticmethod
    def body_force(mass, gravity_x, gravity_y, centre_x, centre_y):
        """N, N, N·m that balance the weight along the surface."""
        fx = -mass * gravity_x
        fy = -mass * gravity_y
        return fx, fy, centre_x * fy - centre_y * fx

    examples = (
        WorkedExample(
            "body_force",
            {"mass": 12, "gravity_x": -2, "gravity_y": 1, "centre_x": 0.1, "centre_y": 0.05},
            (24.0, -12.0, -2.4),
            "12·2; -12·1; 0.1·(-12) - 0.05·24",
        ),
    )
