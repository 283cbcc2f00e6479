"""A robot to test against: it moves by its own equations and may hide what the power model lacks.

    robot = VirtualRobot("minibalance", hidden={"motor_heating": {"size": 0.05}}, seed=3)
    log = robot.drive(robot.profile("rich"), noise=Noise(level=0.02))
    log.write_csv("log.csv");  log.truth["hidden"]

For tests and demonstrations only. It takes numbers from a vehicle's TOML and shares no formula with
the power model: rigid body, wheels, rollers, gears, motors, heat and battery are integrated in time
(``virtual.dynamics``), and a row of the log is what sensors average over its interval.

An effect's strength is given in the catalogue's parameters, or as ``size``: the rms change of the
clean power that it causes on the driven profile, as a share of mean power. Sizes are found one
effect at a time, on a robot without the others. Power is positive when it leaves the battery. The
load's place (com_x, com_y) acts only where com_offset is present; otherwise the load is carried
centred whatever the columns say.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Array
from planner.errors import InputError
from planner.telemetry.virtual.by_formula import add_by_formula
from planner.telemetry.virtual.chassis import read_vehicle
from planner.telemetry.virtual.dynamics import BOOK, MEANS, STEP, integrate
from planner.telemetry.virtual.hidden import (
    EFFECTS,
    Settings,
    check_settings,
    largest_scale,
    scaled,
    strengths,
)
from planner.telemetry.virtual.profiles import ROW, Profile, profile
from planner.telemetry.virtual.routes import planned_route
from planner.telemetry.virtual.sensors import (
    Columns,
    Noise,
    Sensors,
    exact_columns,
    measured_columns,
    rows_of,
)
from planner.terrain.heightmap import Terrain

_SIZE_ROUNDS = 6
"""Corrections of an effect's strength until it has the size that was asked for."""
_SIZE_TOLERANCE = 0.01
"""Share by which the size may differ from that."""
_FEW_RUNS = 8
"""Runs on which the strength is sought first: a third of a usual drive."""


@dataclass(frozen=True)
class VirtualLog:
    """A log as sensors wrote it, and what really happened.

    Attributes:
        columns: name → (rows,), in the order and units of a telemetry log.
        truth: ``hidden`` (settings with the strengths found), ``sizes`` (slug → rms share reached),
            ``clean_power`` (rows,) W without noise, ``held_out`` (labels of runs to keep back),
            ``energy`` (run label → J by place), ``noise`` and ``sensors``.
    """

    columns: Columns
    truth: dict[str, Any]

    def write_csv(self, path: str | Path) -> None:
        """Writes the columns as CSV; numbers keep every digit."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.columns)
            writer.writerows(zip(*(c.tolist() for c in self.columns.values()), strict=True))

    def write_parquet(self, path: str | Path) -> None:
        """Writes the columns as Parquet."""
        import pyarrow
        import pyarrow.parquet

        arrays = {name: pyarrow.array(values.tolist()) for name, values in self.columns.items()}
        pyarrow.parquet.write_table(pyarrow.table(arrays), str(path))

    def select(self, runs: Sequence[str]) -> VirtualLog:
        """The rows of these runs."""
        kept = np.isin(self.columns["run"], list(runs))
        columns = {name: values[kept] for name, values in self.columns.items()}
        return VirtualLog(columns, {**self.truth, "clean_power": self.truth["clean_power"][kept]})

    def split(self) -> tuple[VirtualLog, VirtualLog]:
        """Training and held-out rows, by run."""
        held = set(self.truth["held_out"])
        others = [str(run) for run in np.unique(self.columns["run"]) if str(run) not in held]
        return self.select(others), self.select(sorted(held))

    @staticmethod
    def joined(logs: Mapping[str, VirtualLog]) -> VirtualLog:
        """One log of several, each a run of its own; of what really happened the clean power stays.

        Args:
            logs: name of the run → its log.

        Raises:
            InputError: they have different columns.
        """
        parts = list(logs.values())
        for log in parts:
            if list(log.columns) != list(parts[0].columns):
                raise InputError(
                    "logs", "have different columns", accepted="logs of one robot, driven alike"
                )
        columns = {
            name: np.concatenate([log.columns[name] for log in parts]) for name in parts[0].columns
        }
        columns["run"] = np.repeat(list(logs), [len(log.columns["run"]) for log in parts])
        return VirtualLog(
            columns, {"clean_power": np.concatenate([log.truth["clean_power"] for log in parts])}
        )


class VirtualRobot:
    """A vehicle that moves by its own equations.

    Args:
        vehicle: name of an installed vehicle or path of its TOML.
        hidden: slug → {parameter: value} or {"size": share}; {} takes the vehicle's value of the
            effect, or a usual one. Slugs are the catalogue's and those of ``virtual.hidden``.
        effects: "base" for a robot with the effects of the base model alone, "active" for one that
            also has those that the vehicle's file makes active; ``hidden`` comes on top.
        seed: of the profiles and the noise.
        even_heat: True gives all motors one temperature. Otherwise each has its own, of which the
            log's motor_temp is the mean: a motor that works harder is also hotter than it says.

    Raises:
        VehicleError: the vehicle cannot be used.
        InputError: an effect or parameter that does not exist.
    """

    def __init__(
        self,
        vehicle: str = "minibalance",
        *,
        hidden: Mapping[str, Mapping[str, Any]] | None = None,
        effects: str = "base",
        seed: int = 0,
        even_heat: bool = False,
    ) -> None:
        if effects not in ("base", "active"):
            raise InputError("effects", "unknown", value=effects, accepted="base, active")
        self.vehicle, self.chassis = read_vehicle(vehicle, even_heat=even_heat)
        self.seed = seed
        self.wheels = len(self.chassis.wheels.x)
        known = self.vehicle.parameters
        own: dict[str, Mapping[str, Any]] = {}
        if effects == "active":
            own = {
                slug: {n: v for n, v in known.get(slug, {}).items() if n in EFFECTS[slug]}
                for slug in self.vehicle.active
                if slug in EFFECTS
            }
        self._own = check_settings(own, known, self.wheels)
        self.hidden = check_settings(hidden or {}, known, self.wheels)
        self._last: tuple[Profile, tuple[Settings, dict[str, float]]] | None = None

    def profile(self, design: str, **options: Any) -> Profile:
        """A profile for this vehicle with the robot's seed; see ``virtual.profiles.profile``."""
        return profile(design, self.vehicle, seed=options.pop("seed", self.seed), **options)

    def simulate(self, drive: Profile, settings: Settings | None = None) -> tuple[Array, Array]:
        """Means over bins (runs, bins, columns) and energies (runs, len(BOOK)) of a profile.

        Args:
            drive: what to drive.
            settings: effects without ``size`` in the place of the robot's own.
        """
        if settings is None:
            settings, _ = self._found(drive)
        runs, bins = drive.conditions.shape[:2]
        means = np.empty((runs, bins, len(MEANS) + self.wheels))
        book = np.empty((runs, len(BOOK)))
        strength = strengths(settings, self.wheels, drive.surfaces)
        asked = drive.motion, drive.conditions, drive.starts
        integrate(self.chassis, strength, *asked, means, book, round(drive.bin_length / STEP))
        add_by_formula(self.vehicle, settings, drive, means, book)
        return means, book

    def drive(
        self,
        drive: Profile | str,
        *,
        noise: Noise | Mapping[str, Any] | None = None,
        sensors: Sensors | Mapping[str, Any] | None = None,
        seed: int | None = None,
    ) -> VirtualLog:
        """Drives a profile and logs it.

        Args:
            drive: a profile, or the name of a design.
            noise: scatter of the log; None for the default, ``QUIET`` for none.
            sensors: what is wrong with the sensors.
            seed: of the noise, instead of the robot's.
        """
        if isinstance(drive, str):
            drive = self.profile(drive)
        scatter = noise if isinstance(noise, Noise) else Noise(**(noise or {}))
        faults = sensors if isinstance(sensors, Sensors) else Sensors(**(sensors or {}))
        settings, sizes = self._found(drive)
        means, book = self.simulate(drive, settings)
        exact = exact_columns(drive, means)
        columns, kept = measured_columns(
            exact, drive, means, scatter, faults, self.seed if seed is None else seed
        )
        truth: dict[str, Any] = {
            "hidden": {slug: settings[slug] for slug in self.hidden},
            "sizes": sizes,
            "clean_power": np.asarray(exact["power"], dtype=np.float64)[kept],
            "held_out": drive.held_out,
            "energy": {
                label: dict(zip(BOOK, map(float, book[k]), strict=True))
                for k, label in enumerate(drive.labels)
            },
            "noise": scatter,
            "sensors": faults,
        }
        return VirtualLog(columns, truth)

    def drive_route(
        self,
        route: Any,
        *,
        terrain: Terrain | None = None,
        settings: Mapping[str, float] | None = None,
        noise: Noise | Mapping[str, Any] | None = None,
        row: float = ROW,
    ) -> tuple[float, VirtualLog]:
        """Energy in J that the robot really needs for a planned route, and its log.

        Args:
            route: a Route, or an Answer, whose first route is taken; or the JSON of one of them.
            terrain: the map that it leads over; without it the slope across the path is zero.
            settings: payload, ambient and the like; names of START or CONDITIONS of
                ``virtual.dynamics``.
            noise: scatter of the log; the energy is that of the clean power.
            row: s, interval of a row.

        Raises:
            InputError: there is no route, or it has too few poses.
        """
        given = route.to_json() if hasattr(route, "to_json") else route
        if isinstance(given, Mapping) and "routes" in given:
            if not given["routes"]:
                raise InputError("route", "holds no route", accepted="a ROUTE.json of status ok")
            given = given["routes"][0]
        if not isinstance(given, Mapping) or "poses" not in given:
            raise InputError(
                "route",
                "is no planned route",
                value=route,
                accepted="a Route or an Answer of plan_route, or a ROUTE.json as a dictionary",
            )
        half = float(np.abs(self.chassis.wheels.x).max())
        path = planned_route(given, terrain=terrain, half_length=half, row=row, settings=settings)
        log = self.drive(path, noise=noise)
        return log.truth["energy"]["route"]["supply"], log

    def _found(self, drive: Profile) -> tuple[Settings, dict[str, float]]:
        """Settings without ``size``, and the sizes reached where one was asked for."""
        if self._last is not None and self._last[0] is drive:
            return self._last[1]
        settings: Settings = {**self._own}
        sizes: dict[str, float] = {}
        bare = {slug: values for slug, values in self._own.items() if slug not in self.hidden}
        stages: list[tuple[Profile, Array, float]] = []
        if any("size" in values for values in self.hidden.values()):
            # The scale is sought on few runs and corrected on all.
            if len(drive.labels) > _FEW_RUNS:
                step = len(drive.labels) / _FEW_RUNS
                few = drive.runs([int(k * step) for k in range(_FEW_RUNS)])
                stages.append((few, self._row_power(few, bare), 5.0 * _SIZE_TOLERANCE))
            stages.append((drive, self._row_power(drive, bare), _SIZE_TOLERANCE))

        def share_of(
            slug: str, plain: dict[str, Any], part: Profile, before: Array, scale: float
        ) -> float:
            change = self._row_power(part, {**bare, slug: scaled(plain, slug, scale)}) - before
            return float(np.sqrt(np.mean(change * change)) / abs(np.mean(before)))

        for slug, values in self.hidden.items():
            plain = {name: value for name, value in values.items() if name != "size"}
            scale = 1.0
            for part, before, tolerance in stages if "size" in values else ():
                share = partial(share_of, slug, plain, part, before)
                scale, sizes[slug] = _sized(share, slug, values["size"], scale, tolerance)
            settings[slug] = scaled(plain, slug, scale) if slug in sizes else plain
        self._last = drive, (settings, sizes)
        return settings, sizes

    def _row_power(self, drive: Profile, settings: Settings) -> Array:
        """Clean power by row, (runs, rows) W."""
        return rows_of(self.simulate(drive, settings)[0], drive.row, drive.bin_length)[
            :, :, MEANS.index("power")
        ]


def _sized(
    share: Callable[[float], float], slug: str, wanted: float, scale: float, tolerance: float
) -> tuple[float, float]:
    """Scale of an effect at which ``share(scale)`` is ``wanted``, and the share reached."""
    if wanted == 0.0:
        return 0.0, 0.0
    largest = largest_scale(slug)
    scale = min(scale, largest)
    reached = share(scale)
    power = 1.0  # exponent of the growth of size with strength, learnt on the way
    for _ in range(_SIZE_ROUNDS):
        if reached == 0.0:
            raise InputError(
                f"hidden {slug} size",
                "the effect does nothing on this profile",
                value=wanted,
                accepted="a profile on which it acts",
            )
        new = min(scale * (wanted / reached) ** (1.0 / power), largest)
        if abs(reached / wanted - 1.0) < tolerance or new == scale:
            break
        next_reached = share(new)
        if next_reached > 0.0:
            growth = np.log(next_reached / reached) / np.log(new / scale)
            power = float(np.clip(growth, 0.3, 4.0))
        scale, reached = new, next_reached
    return scale, reached
