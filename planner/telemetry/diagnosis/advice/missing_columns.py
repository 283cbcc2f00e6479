"""Quantities to log: those whose absence explains a misfit, and those that separate aliases.

    slope_to_log(examination, log, residual)   # "Log pitch and roll: …", or None
    Aliases(advice).parted("viscous_drag")       # "Log motor_temp …", for a named effect

Both are simulated before they are recommended.

Slope: without pitch and roll the ground counts as level. A slope that is there adds power in
proportion to the speed along it, upwards as often as downwards. So the residual scatters in
proportion to what a slope would do to the power, and does not at rest. A drag that follows speed
and direction is taken out first; it is the same forwards and backwards. The alternatives are
scatter in proportion to the power itself (a meter's gain), to accelerations (its lag) and to the
yaw rate.

Aliases: with a quantity constant, as far as the log knows, one effect imitates the other. With the
quantity at two levels, run by run, it no longer does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from planner.arrays import Array, Integers
from planner.quantities import INDEX
from planner.telemetry.diagnosis.advice.experiments import CLEARLY, COLD, WARM, Advice
from planner.telemetry.diagnosis.results import Experiment
from planner.telemetry.evidence import Examination
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import clipped
from planner.telemetry.other_terms import SENSORS

SLOPE_SHARE = 0.5
"""Share of the squared error that slopes must explain."""
LARGEST_TILT = 0.25
"""rad; ground that would have to be steeper is not what is missing."""
SCATTER_GAIN = 8.0
"""Log-likelihood by which slopes must beat every alternative, see SURE_GAIN."""
STEADY_SECONDS = 2.0
"""s over which a scatter of slopes stays the same; rows within count as one."""
CELLS = 8
"""Cells of the speed, and of the direction of travel without its sense, that a drag may follow."""
ALIAS_ROWS = 1500
"""Rows on which aliases are compared."""
MOST_TIMES = 4
"""Length of a drive over that of the log, up to which a quantity is recommended."""
LEVELS: dict[tuple[str, ...], tuple[float, float]] = {
    ("motor_temp",): (COLD, WARM),
    ("ambient_temp",): (5.0, 30.0),
    ("com_x", "com_y"): (-0.05, 0.05),
    ("battery_voltage",): (0.9, 1.05),
    ("sensor_rate",): (10.0, 50.0),
}
"""Levels that a log would have: °C, m, share of the battery's voltage, Hz."""


def slope_to_log(examination: Examination, log: Telemetry, residual: Array) -> Experiment | None:
    """The advice to log pitch and roll, where slopes explain most of what stays unexplained.

    Args:
        examination: of the rows.
        log: the rows.
        residual: (n,) W, held-out.
    """
    if {"pitch", "roll", "gravity_x", "gravity_y"} & log.present:
        return None
    model, watts = examination.competitors.library.held_model, examination.watts
    by_tilt = [SENSORS[kind].column(log, model, watts) for kind in ("slope_offset", "roll_offset")]
    left = _without_drag(log, residual)
    if not left.any():
        return None
    spread = np.full(len(log), 1.4826 * float(np.median(np.abs(left))) + 1e-12)
    left = clipped(left, 2.0 * spread)
    ax, ay, wz = (log.rows[:, INDEX[name]] for name in ("ax", "ay", "wz"))
    tilted = np.sqrt(0.5 * (by_tilt[0] ** 2 + by_tilt[1] ** 2))
    rows = STEADY_SECONDS / max(float(np.median(log.interval)), 1e-6)
    fits = [_scatter(left, size) for size in (tilted, watts, np.hypot(ax, ay), wz)]
    lead = (fits[0][0] - max(gain for gain, _ in fits[1:])) / max(rows, 1.0)
    tilt = fits[0][1]
    share = min(tilt**2 * float(np.mean(tilted**2)) / float(np.mean(left**2)), 1.0)
    if share < SLOPE_SHARE or lead < SCATTER_GAIN or tilt > LARGEST_TILT:
        return None
    said = (
        f"Log pitch and roll, from an inertial sensor: slopes of about {math.degrees(tilt):.2g}° "
        f"that the log does not have would explain {100.0 * share:.0f} % of the squared error."
    )
    return Experiment((), said, {})


def _without_drag(log: Telemetry, residual: Array) -> Array:
    """(n,) W, a residual without its mean by speed and direction; opposite ones count as one."""
    vx, vy = log.rows[:, INDEX["vx"]], log.rows[:, INDEX["vy"]]
    speed, direction = np.hypot(vx, vy), np.arctan2(vy, vx) % math.pi
    order = np.argsort(np.argsort(speed, kind="stable")) * CELLS // len(log)
    cell = order * CELLS + np.rint(direction / math.pi * CELLS).astype(np.int64) % CELLS
    count = np.bincount(cell, minlength=CELLS * CELLS)
    mean = np.bincount(cell, residual, CELLS * CELLS) / np.maximum(count, 1)
    return np.asarray(residual - mean[cell])


def _scatter(left: Array, size: Array) -> tuple[float, float]:
    """Log-likelihood gained by a scatter in proportion to a size (n,), and its factor."""
    square, ratio = left**2 / np.mean(left**2), size**2 / max(float(np.mean(size**2)), 1e-300)

    def cost(logs: Array) -> float:
        variance = np.exp(logs[0]) + np.exp(logs[1]) * ratio
        return float(0.5 * np.sum(np.log(variance) + square / variance))

    found = minimize(cost, np.log([0.5, 0.5]), method="Nelder-Mead")
    scale = float(np.mean(left**2)) / max(float(np.mean(size**2)), 1e-300)
    return 0.5 * len(left) - float(found.fun), math.sqrt(math.exp(found.x[1]) * scale)


class Aliases:
    """Effects that are aliased with named ones as long as a quantity is not logged.

    Args:
        advice: for the log.
    """

    def __init__(self, advice: Advice) -> None:
        self.advice = advice
        examination, log = advice.examination, advice.log
        self.library = examination.competitors.library
        # A meter shows what was before: rows alone would not do.
        count = len(log) if log.meter else min(len(log), ALIAS_ROWS)
        self.rows: Integers = np.linspace(0, len(log) - 1, count).astype(np.int64)
        self.probe = log.take(self.rows)
        certainty = advice.slow * math.sqrt(len(log) / count)
        self.scale = (certainty / examination.spread[self.rows])[:, None]

    def parted(self, name: str) -> Experiment | None:
        """The quantity to log that separates a named effect from most aliases."""
        known = self.advice.selection.aliases.get(name, ())
        alternatives = dict.fromkeys([*known, *self.library.absent])
        best: tuple[str, ...] = ()
        said = ""
        for quantities in LEVELS:
            apart = {o: self._parted(name, o, quantities) for o in alternatives}
            separated = tuple(other for other, distance in apart.items() if distance > 0.0)
            if len(separated) > len(best):
                least = min(apart[other] for other in separated)
                best, said = separated, self._sentence(name, separated, quantities, least)
        return Experiment((name, *best), said, {}) if best else None

    def _sentence(
        self, name: str, others: Iterable[str], quantities: tuple[str, ...], distance: float
    ) -> str:
        low, high = LEVELS[quantities]
        times = math.ceil((CLEARLY / distance) ** 2)
        long = "" if times == 1 else f", and drive {times} times as long"
        between = f" from {low:g} to {high:g} °C" if quantities[0].endswith("temp") else ""
        log, vary = " and ".join(quantities), "it" if len(quantities) == 1 else "them"
        return (
            f"Log {log} and let {vary} vary{between}{long}: otherwise no drive tells {name} from "
            f"{' and '.join(others)}."
        )

    def _parted(self, name: str, alternative: str, quantities: tuple[str, ...]) -> float:
        """Standard deviations by which quantities part two effects; 0 if they do not.

        It is also 0 where the effects are told apart without them.
        """
        unknown = {slug: set(self.advice.missing(slug)) for slug in (name, alternative)}
        if not (unknown[name] | unknown[alternative]) & set(quantities):
            return 0.0
        constant, varied = self._levels(quantities)
        after = self._apart(name, alternative, quantities, varied)
        if not CLEARLY <= MOST_TIMES**0.5 * after < math.inf:
            return 0.0
        if alternative in self.advice.selection.aliases.get(name, ()):
            return after
        before = self._apart(name, alternative, quantities, constant)
        return after if before < min(CLEARLY, 0.5 * after) else 0.0

    def _apart(
        self, name: str, alternative: str, quantities: tuple[str, ...], values: Array
    ) -> float:
        """Standard deviations between a named effect and its nearest imitation."""
        examination, ranked = self.advice.examination, self.advice.selection.ranked(name)
        rows = self.probe.rows.copy()
        rows[:, [INDEX[quantity] for quantity in quantities]] = values[:, None]
        known = replace(self.probe, rows=rows, present=self.probe.present | frozenset(quantities))
        raw = examination.raw[self.rows] * self.scale
        effect = raw[:, list(ranked.member.columns)] @ ranked.coefficients
        if set(quantities) & set(self.advice.missing(name)):
            forms = [form * self.scale for form in self.library.forms_of(name, known)]
            alike = [_share(form, effect) for form in forms]
            if not forms or not np.any(alike):
                return math.inf
            form = forms[int(np.argmax(alike))].sum(axis=1)
            effect = form * float(np.linalg.norm(effect) / np.linalg.norm(form))
        beside = [
            c
            for member in self.advice.selection.members
            if member.name != name
            for c in member.columns
        ]
        own = [*range(examination.competitors.tangent), *beside]
        # What is known of data sheet and sensors counts as further rows.
        sure = np.diag(np.sqrt(examination.competitors.known))[examination.competitors.usual][
            :, own
        ]
        base = np.concatenate([raw[:, own], sure])
        effect = np.append(effect, np.zeros(len(sure)))
        forms = [form * self.scale for form in self.library.forms_of(alternative, known)]
        pad = [np.concatenate([form, np.zeros((len(sure), form.shape[1]))]) for form in forms]
        return min((_left(effect, np.column_stack([base, form])) for form in pad), default=math.inf)

    def _levels(self, quantities: tuple[str, ...]) -> tuple[Array, Array]:
        """(n,) values of a quantity that stays as it is, and that alternates from run to run."""
        low, high = LEVELS[quantities]
        if quantities == ("battery_voltage",):
            voltage = self.advice.vehicle.battery.voltage
            low, high = low * voltage, high * voltage
        runs, count = self.probe.run, len(self.probe)
        odd = runs % 2 == 1 if len(np.unique(runs)) > 1 else np.arange(count) >= count // 2
        return np.full(count, 0.5 * (low + high)), np.where(odd, high, low)


def _share(form: Array, effect: Array) -> float:
    """|cosine| between the sum of columns (n, k) and an effect (n,)."""
    whole = form.sum(axis=1)
    size = float(np.linalg.norm(whole) * np.linalg.norm(effect))
    return abs(float(whole @ effect)) / size if size > 0.0 else 0.0


def _left(effect: Array, columns: Array) -> float:
    """Norm of what columns (n, k) leave of an effect (n,)."""
    norms = np.sqrt((columns**2).sum(axis=0))
    columns = columns[:, norms > 0.0] / norms[norms > 0.0]
    found, *_ = np.linalg.lstsq(columns, effect, rcond=1e-8)
    return float(np.linalg.norm(effect - columns @ found))
