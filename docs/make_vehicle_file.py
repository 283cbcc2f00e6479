"""Writes docs/vehicle-file.md from a vehicle's fields: python -m docs.make_vehicle_file.

A test compares the page with what this makes of the fields, so that it cannot go stale.
"""

from __future__ import annotations

import math
from pathlib import Path

from planner.power.vehicles.derived import (
    DUTY,
    NO_LOAD_HEAT,
    ROTOR_TIME,
    WHEEL_DENSITY,
    WHEEL_WIDTH,
)
from planner.power.vehicles.motors import read_motors
from planner.power.vehicles.vehicle_keys import Key, between, vehicle_keys

PAGE = Path(__file__).with_name("vehicle-file.md")

HEAD = f"""# The vehicle file

`python -m docs.make_vehicle_file` writes this page from the fields that the reader knows.

```sh
joulepath vehicles new > my-robot.toml        # a file to fill in
joulepath vehicles check my-robot.toml        # what is derived, assumed and odd
joulepath vehicles minibalance --toml         # an installed one, with a comment for each key
```

Each value is a number in SI, or a table that states more of it:

```toml
[body]
mass = 12.5
length = {{ value = 750, unit = "mm", source = "data sheet, page 2", uncertainty = 0.02 }}
```

`unit` is any unit that converts to the SI one, in any usual spelling: "mN·m/A", "mNm/A" and
"mN*m/A" are the same. A torque constant may be a speed constant in rpm/V, a capacity a charge in
Ah beside `battery.voltage`. `source` starts with "assumed" where nobody stated the value.
`uncertainty` is the standard deviation as a share of the value. A
diagnosis takes it for mass, wheel radius and wheel places in the place of its usual 5 %.
Unknown keys are refused, and those of another layout.

## From a data sheet

| the sheet states | the file |
|---|---|
| current at a standstill, at a voltage V | `resistance` = V / that current |
| speed and current without load at V | `torque_constant` = (V − resistance · current) / speed; \
the speed in rad/s of the motor, which is the wheel's times `gear_ratio` |
| rated torque, current and speed at V | `torque_constant` = torque / (current − no-load current); \
`resistance` = (V − torque_constant · speed) / current; `continuous_torque` = the rated torque; \
all of the motor before its gear |
| rated power and speed | rated torque = power / speed in rad/s; the current is missing still |
| wheelbase, track | `half_wheelbase`, `half_track`: half of each |
| "lever" or "wheel offset" of an omni robot | `base_radius` |
| no-load current | `no_load_current` |
| battery in Ah or Wh | `capacity`, with its unit; `voltage` is the nominal one |
| speed, run time, current | check them against the table of `joulepath vehicles check` |

## Derived values

| key | formula |
|---|---|
| `body.yaw_inertia` | mass/12·(length² + width²), a plate |
| `wheels.inertia` | `wheels.mass`/2·radius²; without the mass a disc of \
{WHEEL_DENSITY:g} kg/m³ that is {WHEEL_WIDTH:g}·radius wide |
| `drive.coulomb_torque` | torque_constant·no_load_current; where that is not given, \
torque_constant·√({NO_LOAD_HEAT:g} W/resistance) |
| `drive.rotor_inertia` | {1e3 * ROTOR_TIME:g} ms·torque_constant²/resistance; at most so much \
that all rotors act like the robot's mass |
| `battery.voltage` | nominal voltage of the motor, where `motor` names one |
| `limits.voltage` | {DUTY:g}·`battery.voltage`, where that is given or follows from the motor |
| `battery.capacity` | charge·`battery.voltage`, where it is given in Ah |
| `open_circuit_voltage`, `internal_resistance` of `battery_sag` | \
`battery.voltage`, `battery.resistance` |

A key that the file gives is never derived. `joulepath vehicles check` and the answer to a request
list derived values and defaults.
"""

EFFECTS = """
## [effects]

`active` lists the [effects](effects.md) beside the base model that planning uses. A table for each
effect gives its parameters, for example:

```toml
[effects]
active = ["driver_loss"]
[effects.driver_loss]
bridge_resistance = { value = 30, unit = "mΩ", source = "data sheet of the bridge" }
```
"""


def vehicle_file_page() -> str:
    """Text of docs/vehicle-file.md."""
    lines = [HEAD, "## Fields", "", "`name` and `title` are text.", ""]
    for table, keys in vehicle_keys().items():
        lines += [
            *([""] if lines[-1].startswith("|") else []),
            f"### [{table}]",
            "",
            "| key | unit | default | range | |",
            "|---|---|---|---|---|",
            *map(_row, keys.values()),
        ]
    lines += [EFFECTS, "## Motors", "", '`motor = "NAME"` in `[drive]` takes these values:', ""]
    lines += ["| name | what | values |", "|---|---|---|"]
    for motor in read_motors().values():
        values = ", ".join(
            f"{key.partition('.')[2]} {value['value']:g} {value['unit']}"
            + (" (assumed)" if ": assumed" in value["source"] else "")
            for key, value in motor.values.items()
        )
        lines.append(f"| `{motor.name}` | {motor.title} | {values} |")
    return "\n".join(lines) + "\n"


def _row(key: Key) -> str:
    unit = "text" if not key.unit else "" if key.unit == "1" else key.unit
    bounds = "" if key.bounds is None else between(*key.bounds, "1")
    return f"| `{key.name}` | {unit} | {_default(key)} | {bounds} | {key.meaning} |"


def _default(key: Key) -> str:
    if key.required:
        return "required" if key.required == "yes" else "required by its layout"
    if key.derived:
        return "derived"
    if key.default is None or math.isnan(key.default):
        return ""
    return "no limit" if math.isinf(key.default) else f"{key.default:g}"


if __name__ == "__main__":
    PAGE.write_text(vehicle_file_page(), encoding="utf-8")
