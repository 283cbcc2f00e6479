"""Effects that the virtual robot has no equation for: the catalogue's own formula is their truth.

    add_by_formula(vehicle, settings, drive, means, book)

The robot drives without such an effect. For the state of each bin the vehicle's base model says
what the effect's formula adds to its power, and the robot's power rises by that. Such a truth is
the power model's own: it tests whether the effect is found, not whether its formula is right.

Left out: what the effect would change in the motion, the heat and the motors' currents.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.arrays import Array
from planner.power.catalogue import find_effect
from planner.power.model import PowerModel
from planner.power.rows import gravity_columns, rows_from
from planner.power.vehicles import Vehicle
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.virtual.dynamics import BOOK, MEANS, by_name
from planner.telemetry.virtual.hidden import EQUATIONS, OUTSIDE, Settings, by_element
from planner.telemetry.virtual.profiles import Profile

PLACES = {
    "body force": "body",
    "wheel load": "rolling",
    "contact": "rolling",
    "drive": "mesh",
    "driver": "driver",
    "bus": "electronics",
    "supply": "battery",
}
"""Stage of an effect → the place in the robot's energy account that gets its energy."""


def add_by_formula(
    vehicle: Vehicle, settings: Settings, drive: Profile, means: Array, book: Array
) -> None:
    """Add what effects without an equation take to the power, the current and the energies.

    Args:
        vehicle: gives the base model.
        settings: hidden effects and their strengths.
        drive: what was driven.
        means: (runs, bins, len(MEANS) + n), changed.
        book: (runs, len(BOOK)) J, changed.
    """
    slugs = [slug for slug in settings if slug not in EQUATIONS and slug not in OUTSIDE]
    if not slugs:
        return
    rows = _rows(drive, means)
    surface = rows[:, INDEX["surface"]].astype(int)
    for slug in slugs:
        without = PowerModel.from_vehicle(vehicle, effects=[slug], surfaces=drive.surfaces)
        without = without.without_candidates()
        values = without.parameters.copy()
        for place, (effect, name, parameter, element) in enumerate(without.slots):
            if effect.slug == slug:
                given = settings[slug][name]
                parts = by_element(slug, name, given, len(without.wheels), without.surfaces)
                values[place] = parts[element if parameter.per else 0]
        labels = np.array([without.surfaces.index(name) for name in drive.surfaces])
        rows[:, INDEX["surface"]] = labels[surface]
        acting = replace(without, parameters=values)
        watts = acting.share_of(slug, rows).reshape(means.shape[:2])
        means[:, :, MEANS.index("power")] += watts
        means[:, :, MEANS.index("battery_current")] += (
            watts / means[:, :, MEANS.index("battery_voltage")]
        )
        for name in ("supply", PLACES[find_effect(slug).stages()[-1]]):
            book[:, BOOK.index(name)] += watts.sum(axis=1) * drive.bin_length


def _rows(drive: Profile, means: Array) -> Array:
    """(runs · bins, ROW_LENGTH) states of all bins, one run after the other."""
    runs, bins = means.shape[:2]
    columns = by_name(means, drive.conditions, drive.starts)
    columns["ambient_temp"] = columns["ambient"]
    columns |= gravity_columns(columns["roll"], columns["pitch"], gravity=STANDARD_GRAVITY)
    columns["yaw_acceleration"] = np.gradient(columns["wz"], drive.bin_length, axis=1)
    driven = np.cumsum(np.hypot(columns["vx"], columns["vy"]), axis=1) * drive.bin_length
    columns["odometer"] = columns["odometer"] + driven
    columns["time_since_start"] = np.tile((np.arange(bins) + 0.5) * drive.bin_length, (runs, 1))
    return rows_from(**{name: columns[name].ravel() for name in INDEX if name in columns})
