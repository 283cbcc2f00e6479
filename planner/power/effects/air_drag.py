"""Air drag: force of the air on a body that moves against it.

    F = ½·ρ·C_dA·|v - w|·(v - w)        w: velocity of the air

Sign
    the force that the wheels must supply. A tailwind faster than the robot pushes it.
Source
    aerodynamic drag law, e.g. Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992, chapter 4;
    C_dA 0.18 m² for a box of 0.52 m by 0.35 m (estimate).
Holds for
    turbulent flow round a bluff body; the same drag area in all directions.
Left out
    lift, yaw moment, change of density with height. Unknown wind counts as still air.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import known, root


class AirDrag(Effect):
    """Aerodynamic resistance in still air or wind."""

    slug = "air_drag"
    title = "air"

    drag_area = Parameter(unit="m²", default=0.18, null=0.0, bounds=(0.0, 50.0), spread=0.3)
    """Drag coefficient times area."""
    air_density = Parameter(unit="kg/m³", default=1.2, bounds=(0.3, 2.0), fitted=False)
    """Of dry air at 20 °C."""

    @staticmethod
    def body_force(vx, vy, wind_x, wind_y, drag_area, air_density):
        """N, N, N·m that the wheels must supply."""
        x = vx - wind_x if known(wind_x) else vx
        y = vy - wind_y if known(wind_y) else vy
        force = 0.5 * air_density * drag_area * root(x * x + y * y)
        return force * x, force * y, 0.0 * force

    examples = (
        WorkedExample(
            "body_force",
            {
                "vx": 1.0,
                "vy": 0.5,
                "wind_x": -2.0,
                "wind_y": 4.5,
                "drag_area": 0.2,
                "air_density": 1.25,
            },
            (1.875, -2.5, 0.0),
            "v - w = (3, -4), ½·1.25·0.2·5 = 0.625 per m/s",
        ),
    )
