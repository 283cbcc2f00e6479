"""Propose a formula for an effect that the catalogue does not have.

    found = propose(examination, axis, shape, log, model, additions, given)
    found.outside, found.addition

The shape that stood out names the axis. Every function of the dictionary over that axis, alone or
times the speed, is then tried with its threshold, width or constant moved to where it explains
most; the one that predicts held-out runs best becomes a custom effect
(planner.power.formulas.custom) and is fitted with all other parameters. Where these runs show that
its strength goes with the load, it does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from planner.arrays import Array
from planner.power.effect import Effect
from planner.power.formulas import custom_effect
from planner.power.model import PowerModel
from planner.quantities import STANDARD_GRAVITY
from planner.telemetry.diagnosis.results import Outside
from planner.telemetry.estimation import Fit
from planner.telemetry.evidence import Examination
from planner.telemetry.holdout import LinearHeldout, rms, supports
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import CLIP, counted, huber
from planner.telemetry.other_terms import Dictionary, Shape
from planner.telemetry.prediction import Readings
from planner.telemetry.quantities_of_motion import STANDSTILL, STEADY_YAW
from planner.telemetry.selection import ShapeFound
from planner.telemetry.terms import Addition, fit_with

TUNED_SHAPES = 5
"""Best shapes whose place and width are optimised."""
ROBUST_ROUNDS = 4
"""Rounds of a robust fit, each of what the ones before have left, cut anew."""
CURVE_EDGES = 41
"""Borders between the bins of a reported curve."""
MOST_OWN_LOAD = 1e3
"""kg that count beside the payload; with more the load hardly matters."""
MOST_STRENGTH = 1e6
"""W per unit of a shape: no bound in practice."""


@dataclass(frozen=True)
class _Text:
    """An axis in the language of custom formulas."""

    expression: str
    unit: str
    fixed: dict[str, dict[str, Any]]


_STILL = {
    "standstill": {"unit": "m/s", "bounds": (1e-3, 1), "default": STANDSTILL, "fitted": False}
}
_STEADY = {
    "steady_yaw": {"unit": "rad/s", "bounds": (1e-3, 1), "default": STEADY_YAW, "fitted": False}
}
_LENGTH = "sqrt(vx * vx + vy * vy + standstill * standstill)"
_GRAVITY: dict[str, Any] = {"unit": "m/s^2", "bounds": (1, 30), "default": STANDARD_GRAVITY}
_SLOPE = {**_STILL, "gravity": {**_GRAVITY, "fitted": False}}


_BODIES = {
    "power": "{x} ** {n}",
    "size": "abs({x})",
    "bump": "bump({x}, centre, width)",
    "hump": "tanh(abs({x}) / steady_yaw) * bump(abs({x}), centre, width)",
    "lobe": "exp((cos({x} - centre) - 1) / (width * width))",
    "cos": "(even * cos({n} * heading) + odd * sin({n} * heading))",
    "sin": "(even * cos({n} * heading) + odd * sin({n} * heading))",
    "above": "hinge({x} - threshold)",
    "outside": "hinge(abs({x}) - threshold)",
    "below": "hinge(threshold - {x})",
    "decay": "exp(-{x} / time_constant)",
    "fading": "tanh({x} / standstill) * exp(-{x} / fading_speed)",
    "moving": "tanh({x} / standstill)",
    "step": "(0.5 + 0.5 * tanh(({x} - threshold) / width))",
}
_ORDERS = {"size": 1, "above": 1, "outside": 1, "below": 1}
"""Powers of the axis' unit in a shape of each kind, where not 0; a power has its own."""
_MOVABLE = {
    "bump": {"at": "centre", "width": "width"},
    "hump": {"at": "centre", "width": "width"},
    "lobe": {"at": "centre", "width": "width"},
    "above": {"at": "threshold"},
    "below": {"at": "threshold"},
    "outside": {"at": "threshold"},
    "decay": {"at": "time_constant"},
    "fading": {"at": "fading_speed"},
    "step": {"at": "threshold"},
}
"""What of a shape can be moved, by its kind, and its name in a formula."""
_SCALED = ("decay", "fading")
"""Kinds that are moved by a share of where they are."""


def _movable(shape: Shape) -> dict[str, str]:
    """What of a shape can be moved, and its name in a formula."""
    own_load = {} if shape.own_load is None else {"own_load": "own_load"}
    return {**_MOVABLE.get(shape.kind, {}), **own_load}


def _axis_text(axis: str, temperature: str) -> _Text:
    return {
        "speed": _Text("speed", "m/s", {}),
        "heading": _Text("heading", "1", {}),
        "slope_along": _Text(
            f"(-(gravity_x * vx + gravity_y * vy) / (gravity * {_LENGTH}))", "1", _SLOPE
        ),
        "slope_across": _Text(
            f"(-(gravity_y * vx - gravity_x * vy) / (gravity * {_LENGTH}))", "1", _SLOPE
        ),
        "yaw_rate": _Text("wz", "rad/s", {}),
        "acceleration": _Text(f"((ax * vx + ay * vy) / {_LENGTH})", "m/s^2", _STILL),
        "load": _Text("payload", "kg", {}),
        "temperature": _Text(temperature, "K", {}),
        "air": _Text("ambient_temp", "K", {}),
        "time_since_start": _Text("time_since_start", "s", {}),
    }[axis]


def _power_unit(axis_unit: str, order: int, times_speed: int, *, laden: bool) -> str:
    unit = "W/kg" if laden else "W"
    if order and axis_unit != "1":
        unit += f"/({axis_unit})" if order == 1 else f"/({axis_unit})^{order}"
    if times_speed:
        unit += "/(m/s)" if times_speed == 1 else f"/(m/s)^{times_speed}"
    return unit


def _bounds(shape: Shape, span: tuple[float, float]) -> list[tuple[float, float]]:
    """Where what can be moved of a shape may lie: its place, its width, its own load."""
    low, high = span
    length, most = max(high - low, 1e-9), max(abs(low), abs(high))
    places: list[tuple[float, float]] = []
    if shape.kind in ("bump", "lobe"):  # narrower, a single speed that was driven looks like one
        ends = low - length, high + length
        # A side may lie opposite to all headings that were driven.
        turn = (low - 2.0 * np.pi, high + 2.0 * np.pi)
        places = [turn if shape.kind == "lobe" else ends, (0.04 * length, 2.0 * length)]
    elif shape.kind == "hump":
        places = [(0.0, most), (0.04 * most, 2.0 * most)]
    elif shape.kind in _SCALED:
        places = [(0.005 * length, 10.0 * length)]
    elif shape.kind in _MOVABLE:
        places = [(0.0, most) if shape.kind == "outside" else (low, high)]
    return places if shape.own_load is None else [*places, (0.0, MOST_OWN_LOAD)]


def formula_of(
    shape: Shape, span: tuple[float, float], temperature: str, coefficients: Sequence[float]
) -> tuple[type[Effect], dict[tuple[str, int], float]]:
    """A custom effect for a shape, and where its fit starts.

    Args:
        shape: the shape; of a harmonic either of the two.
        span: range of its axis in the log.
        temperature: quantity of the temperature axis.
        coefficients: W per unit of the shape; two for a harmonic (cosine, sine).
    """
    text = _axis_text(shape.axis, temperature)
    shaping: dict[str, dict[str, Any]] = {}
    start: dict[tuple[str, int], float] = {}
    strengths = ["even", "odd"] if shape.kind in ("cos", "sin") else ["strength"]
    n = int(shape.at)
    order = n if shape.kind == "power" else _ORDERS.get(shape.kind, 0)
    body = _BODIES[shape.kind].format(x=text.expression, n=n).removesuffix(" ** 1")
    for (attribute, name), bounds in zip(
        _movable(shape).items(), _bounds(shape, span), strict=True
    ):
        value, moved_in = getattr(shape, attribute), "kg" if name == "own_load" else text.unit
        shaping[name] = {"unit": moved_in, "bounds": bounds, "default": value}
        start[name, 0] = float(np.clip(value, *bounds))
    fixed = dict(text.fixed)
    if shape.kind in ("fading", "moving"):
        fixed |= _STILL
    if shape.kind == "hump":
        fixed |= _STEADY
    if shape.kind == "step":
        width = {"unit": text.unit, "bounds": (1e-9, 1e9), "default": shape.width, "fitted": False}
        fixed["width"] = width
    factor = "" if shape.times_speed == 0 else " * speed"
    factor += f" ** {shape.times_speed}" if shape.times_speed > 1 else ""
    if shape.axis == "heading" and shape.times_speed == 0:
        factor = " * tanh(speed / standstill)"
        fixed |= _STILL
    laden = shape.own_load is not None
    factor += " * (payload + own_load)" if laden else ""
    unit = _power_unit(text.unit, order, shape.times_speed, laden=laden)
    parameters: dict[str, dict[str, Any]] = {
        name: {"unit": unit, "bounds": (-MOST_STRENGTH, MOST_STRENGTH), "null": 0.0}
        for name in strengths
    }
    for name, value in zip(strengths, coefficients, strict=True):
        start[name, 0] = float(value)
    formula = f"{body}{factor}" if len(strengths) > 1 else f"strength * {body}{factor}"
    effect = custom_effect(
        f"unknown_{shape.axis}",
        formula,
        "W",
        {**parameters, **shaping, **fixed},
        title=f"unknown effect over {' and '.join(shape.quantities).replace('_', ' ')}",
        doc="Proposed from a log by what the catalogue left over.",
    )
    return effect, start


@dataclass(frozen=True)
class Proposal:
    """A formula that was fitted.

    Attributes:
        outside: what is reported.
        addition: how to add it to a model.
        fit: the model with the selection and the formula.
    """

    outside: Outside
    addition: Addition
    fit: Fit


def propose(
    examination: Examination,
    axis: str,
    shape: ShapeFound,
    log: Telemetry,
    model: PowerModel,
    additions: Sequence[Addition],
    given: Sequence[int],
) -> Proposal:
    """Find the best formula over the axis of a shape that stood out.

    Args:
        examination: of the rows of ``log``.
        axis: over which something stood out.
        shape: how clearly it did.
        log: the rows.
        model: the model without any additions, fitted.
        additions: what was selected beside it.
        given: columns of what was selected.
    """
    dictionary = examination.competitors.dictionary
    tuner = _Tuner(examination, log, given)
    tuned = [tuner.tuned(tried) for tried in _ranked(examination, axis, given)[:TUNED_SHAPES]]
    best, coefficients = min(tuned, key=lambda entry: tuner.heldout_rmse(entry[0]))
    if best.axis == "heading" and "speed" in dictionary.ranges:
        # A wide lobe is the same in every direction: brakes, or motors that are switched on.
        plain = tuner.tuned(Shape("speed", "moving"))
        left, less = (tuner.heldout_residual(one) for one in (plain[0], best))
        if not supports(log, left, less, examination.spread):
            best, coefficients = plain
    if axis != "load" and "load" in dictionary.ranges:
        laden = tuner.tuned(replace(best, own_load=dictionary.ranges["load"][1]))
        left, less = (tuner.heldout_residual(one) for one in (best, laden[0]))
        if supports(log, left, less, examination.spread):
            best, coefficients = laden
    span = dictionary.ranges[best.axis]
    effect, start = formula_of(best, span, dictionary.temperature, coefficients)
    addition = Addition(effect, start)
    fitted = fit_with(model, log, [*additions, addition], noise=examination.noise)
    curve = _curve(fitted.model, effect, log, best.axis, dictionary)
    formula = str((effect.definition or {})["formula"])
    outside = Outside(best.quantities, curve, effect.slug, formula, effect, shape.z, shape.size)
    return Proposal(outside, addition, fitted)


def _ranked(examination: Examination, axis: str, given: Sequence[int]) -> list[Shape]:
    """One shape of every family over an axis, by the likelihood that it gains; harmonics paired."""
    competitors, evidence = examination.competitors, examination.evidence
    dictionary = competitors.dictionary
    best: dict[tuple[str, str, int], tuple[float, Shape]] = {}
    for number in examination.shapes:
        shape = dictionary.shapes[number]
        if shape.axis != axis:
            continue
        columns = [competitors.first_shape + number]
        if shape.kind in ("cos", "sin"):
            columns.append(competitors.first_shape + dictionary.quadrature(number))
            shape = replace(shape, kind="cos")
        gain = evidence.gain([*given, *columns])[0] - 2.0 * len(columns)
        family = shape.family if shape.kind != "power" else (*shape.family[:2], int(shape.at) * 10)
        if family not in best or gain > best[family][0]:
            best[family] = (gain, shape)
    return [shape for _, shape in sorted(best.values(), key=lambda entry: -entry[0])]


class _Tuner:
    """Moves thresholds, centres and widths of shapes to where they explain most.

    Everything else is taken as linear around the examination, so that no kernel is compiled for a
    formula before it is known to be the best one.
    """

    def __init__(self, examination: Examination, log: Telemetry, given: Sequence[int]) -> None:
        self.examination = examination
        self.log, self.given = log, given
        self.linear = LinearHeldout(log, examination)
        evidence = examination.evidence
        rows = log.rows_for(examination.competitors.library.model.surfaces)
        dictionary = examination.competitors.dictionary
        self.dictionary = dictionary
        self.rows = rows
        own = self._white(examination.raw[:, [*evidence.tangent.tolist(), *given]])
        self.basis, _ = np.linalg.qr(own / (np.sqrt((own**2).sum(axis=0)) + 1e-300))
        # Not clipped: a shape in the wrong place would make outliers of the rows that it misses.
        self.target = self._white(examination.residual[:, None])[:, 0]
        self.loss = self._fitted(np.empty((len(log), 0)))[0]

    def _white(self, columns: Array) -> Array:
        examination = self.examination
        return examination.noise.whiten(self.log, examination.watts, examination.spread, columns)

    def gain(self, shape: Shape) -> tuple[float, Array]:
        """Log-likelihood that a shape gains, and its coefficients (cosine and sine)."""
        loss, found = self._fitted(self._white(self._columns(shape)))
        return 0.5 * (self.loss - loss), found

    def heldout_rmse(self, shape: Shape) -> float:
        """W, on held-out runs, of the model with a shape in its place."""
        return rms(counted(self.heldout_residual(shape), self.examination.spread))

    def heldout_residual(self, shape: Shape) -> Array:
        """(n,) W, of held-out runs, of the model with a shape in its place."""
        return self.linear.residual_beside(self._columns(shape), self.given)

    def _columns(self, shape: Shape) -> Array:
        """(n, 1) W per unit of a shape, as the meter shows it; (n, 2) of a harmonic."""
        pair = (shape, replace(shape, kind="sin")) if shape.kind == "cos" else (shape,)
        return Readings.as_shown(self.log, self.dictionary.only(pair).columns(self.rows))

    def _fitted(self, white: Array) -> tuple[float, Array]:
        """Robust loss of the model's columns with some more (n, k), and the coefficients of these.

        Every round fits what is left, cut where the loss bends (Huber's pseudo-observations).
        """
        clear = white - self.basis @ (self.basis.T @ white)
        gram, left = clear.T @ clear, self.target
        total = np.zeros(white.shape[1])
        for _ in range(ROBUST_ROUNDS):
            cut = np.clip(left, -CLIP, CLIP)
            found = np.linalg.lstsq(gram, clear.T @ cut, rcond=1e-10)[0]
            left = left - clear @ found - self.basis @ (self.basis.T @ cut)
            total = total + found
        return float(huber(left).sum()), total

    def tuned(self, shape: Shape) -> tuple[Shape, tuple[float, ...]]:
        """The shape at its best place, and its coefficients."""
        names = _movable(shape)
        if names:
            low, high = self.dictionary.ranges[shape.axis]
            span = max(high - low, 1e-9)
            bounds = _bounds(shape, (low, high))
            start = [
                float(np.clip(getattr(shape, name), *limits))
                for name, limits in zip(names, bounds, strict=True)
            ]

            def moved(place: Array) -> Shape:
                numbers: dict[str, Any] = dict(zip(names, map(float, place), strict=True))
                return replace(shape, **numbers)

            def loss(place: Array) -> float:
                possible = all(a <= x <= b for x, (a, b) in zip(place, bounds, strict=True))
                return -self.gain(moved(place))[0] if possible else 0.0

            steps = [
                0.15 * (abs(s) if shape.kind in _SCALED or name == "own_load" else span)
                for name, s in zip(names, start, strict=True)
            ]
            simplex = np.array([start, *(np.array(start) + np.diag(steps))])
            found = minimize(
                loss,
                start,
                method="Nelder-Mead",
                options={"initial_simplex": simplex, "maxfev": 60, "xatol": 1e-3 * span},
            )
            # A place within a run may follow that run alone.
            shape = min((shape, moved(found.x)), key=self.heldout_rmse)
        return shape, tuple(self.gain(shape)[1].tolist())


def _curve(
    model: PowerModel, effect: type[Effect], log: Telemetry, axis: str, dictionary: Dictionary
) -> tuple[tuple[float, float], ...]:
    """Median of what the effect adds along its axis, W, over equal shares of the rows."""
    rows = log.rows_for(model.surfaces)
    values = dictionary.axes(rows)[axis]
    watts = model.share_of(effect.slug, rows)
    known = np.flatnonzero(np.isfinite(values))
    low, high = np.percentile(values[known], [0.5, 99.5])
    edges = np.linspace(low, high, CURVE_EDGES)
    bins = np.digitize(values[known], edges)
    points = []
    for k in range(1, CURVE_EDGES):
        inside = known[bins == k]
        if len(inside):
            points.append((float(np.median(values[inside])), float(np.median(watts[inside]))))
    return tuple(points)
