"""A vehicle's TOML file: found, read, checked and turned into SI numbers with their sources.

    vehicle = load_vehicle("minibalance")          # a name of planner/power/vehicles, or a path

Every value is a number in SI or ``{ value, unit, source, uncertainty }``; any unit that converts to
the SI one is taken. Unknown keys are refused with the nearest known one. What makes a robot this
one and no other is required: body mass, length, width; wheels layout with its geometry and radius;
drive gear_ratio, torque_constant, resistance, the last two also from ``motor``. Another missing key
is derived (``derived`` has the formula) or takes its default (``defaults_taken`` names it).
"""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import Any

from planner.errors import VehicleError
from planner.power.vehicles.vehicle import Vehicle
from planner.power.vehicles.vehicle_reader import VehicleReader
from planner.reading import parse_toml

VEHICLE_FOLDER = Path(__file__).parent


def list_vehicles() -> list[dict[str, object]]:
    """Name, title, mass, size and active effects of every vehicle that is installed."""
    found = []
    for path in sorted(VEHICLE_FOLDER.glob("*.toml")):
        vehicle = load_vehicle(path.stem)
        found.append(
            {
                "name": vehicle.name,
                "title": vehicle.title,
                "mass_kg": vehicle.mass,
                "length_m": vehicle.length,
                "width_m": vehicle.width,
                "wheels": vehicle.layout.wheel_count,
                "effects": list(vehicle.active),
                "battery_j": vehicle.battery.capacity,
            }
        )
    return found


def load_vehicle(name: str | Path) -> Vehicle:
    """The vehicle of this name, or in the TOML file at this path.

    Raises:
        VehicleError: no such vehicle, or a value in its file cannot be used.
    """
    known = sorted(path.stem for path in VEHICLE_FOLDER.glob("*.toml"))
    if not isinstance(name, str | Path):
        raise VehicleError(
            "vehicle", "is no name", value=name, accepted=f"{', '.join(known)}, a .toml path"
        )
    path = VEHICLE_FOLDER / f"{name}.toml" if name in known else Path(name)
    # Unlike Path.is_file this does not raise for a name that no file can have.
    if name not in known and (path.suffix != ".toml" or not os.path.isfile(path)):
        raise VehicleError(
            "vehicle", "no such vehicle", value=name, accepted=f"{', '.join(known)}, a .toml path"
        )
    return _load(path, path.stat().st_mtime_ns)[0]


def wheel_values(name: str) -> dict[str, Any]:
    """What the [wheels] table of a vehicle's file holds, numbers in SI; ``layout`` is its name.

    Raises:
        VehicleError: as ``load_vehicle``.
    """
    load_vehicle(name)
    path = VEHICLE_FOLDER / f"{name}.toml"
    path = path if path.is_file() else Path(name)
    return dict(_load(path, path.stat().st_mtime_ns)[1])


@lru_cache(maxsize=64)  # parsed files of a few kB
def _load(path: Path, _changed: int) -> tuple[Vehicle, dict[str, Any]]:
    accepted = "a vehicle's TOML"
    try:
        document = parse_toml(path.read_bytes())
    except OSError as error:
        raise VehicleError(
            str(path), f"cannot be read: {error.strerror}", accepted=accepted
        ) from error
    except ValueError as error:
        raise VehicleError(str(path), f"not TOML: {error}", accepted=accepted) from error
    reader = VehicleReader(str(path), document)
    vehicle = reader.vehicle()
    return vehicle, reader.si["wheels"] | {"layout": document["wheels"]["layout"]}
