"""Charts of a residual: predicted against measured, over time, over each axis, around the compass.

Watts are measured minus predicted: above zero the robot needs more than the model says. Amber is
the model at the start, teal the one that was proposed or made.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from planner.amounts import signed, watts
from planner.arrays import Array
from planner.report.axes import Axes, nice_ticks, padded
from planner.report.drawing import chart, circle, line, text
from planner.report.markup import Markup, element, joined
from planner.report.workbench.residuals import SURE, Axis, Bins, Curve, Look, axis_of
from planner.telemetry.pictures import ResidualCurve, Stretch

RESIDUAL = "measured − predicted (W)"
_FEW = 8  # bins from which on a curve needs no dots
_SMALL = (350, 215)
"""Pixels, width and height of a chart among several."""
_COMPASS = {-180.0: "back", -90.0: "right", 0.0: "forward", 90.0: "left", 180.0: "back"}


def cloud(look: Look) -> Markup:
    """Predicted against measured power of rows spread over the log."""
    shown = np.concatenate([look.measured, *look.predicted.values()])
    most = max(float(look.measured.max()), float(np.quantile(shown, 0.999)))
    limits = padded(float(shown.min()), most, 0.03)
    axes = Axes(430, 330, limits, limits)
    ends = np.array(limits)
    parts = [axes.frame("measured (W)", "predicted (W)"), axes.line(ends, ends, "zero")]
    parts += [axes.cloud(look.measured, watts, kind) for kind, watts in look.predicted.items()]
    said = f"{len(look.measured):,} rows; on the diagonal prediction and measurement agree."
    return axes.svg(joined(*parts), "Predicted against measured power", said)


def distribution(look: Look, floor: float) -> Markup:
    """How often which error occurs, beside the log's own noise."""
    widest = np.quantile(np.abs(look.residuals["before"]), 0.995)
    limit = float(max(widest, 3.0 * floor, 1e-6))
    edges = np.linspace(-limit, limit, 61)
    width = edges[1] - edges[0]
    middle = 0.5 * (edges[1:] + edges[:-1])
    heights = {
        kind: np.histogram(values, edges)[0] / (max(len(values), 1) * width)
        for kind, values in look.residuals.items()
    }
    spread = max(floor, width)  # a log without noise would be one infinite line
    noise = np.exp(-0.5 * (middle / spread) ** 2) / (spread * math.sqrt(2 * math.pi))
    top = max(float(values.max()) for values in (*heights.values(), noise))
    axes = Axes(430, 330, (-limit, limit), (0.0, 1.08 * top))
    xs = np.repeat(edges, 2)[1:-1]
    parts = [axes.frame(RESIDUAL, "share of the rows per watt")]
    for kind, values in heights.items():
        ys = np.repeat(values, 2)
        parts.append(axes.area(xs, np.zeros_like(ys), ys, f"{kind} area"))
        parts.append(axes.line(xs, ys, f"{kind} thin"))
    parts.append(axes.line(middle, noise, "noise dashed"))
    said = "Dashed: how the errors of a model that lacks nothing would be spread."
    return axes.svg(joined(*parts), "How large the errors are", said)


def over_time(stretch: Stretch) -> Markup:
    """Measured and predicted power in the stretch in which the model at the start errs most."""
    lines = {"measured broad": stretch.measured}
    lines |= {f"{kind} thin": watts for kind, watts in stretch.predicted.items()}
    values = np.concatenate([*lines.values()])
    times = (float(stretch.time[0]), float(stretch.time[-1]))
    axes = Axes(800, 240, times, padded(float(values.min()), float(values.max())))
    parts = [axes.frame("time since the start of the run (s)", "power (W)")]
    parts += [axes.line(stretch.time, watts, kind) for kind, watts in lines.items()]
    return axes.svg(joined(*parts), f"Power over time in {stretch.run}")


def common_range(curves: Sequence[Curve]) -> float:
    """W that all charts of a page reach, so that axes can be compared."""
    starts = [curve["before"] for curve in curves]
    sizes = [np.abs(bins.bias) + np.nan_to_num(bins.stderr) for bins in starts]
    # One bin of few rows must not make everything else flat.
    largest = [float(np.quantile(s, 0.97)) for s in sizes] or [0.0]
    return max(*largest, 1e-3) * 1.15


def residual_chart(name: str, curve: Curve, most: float) -> Markup:
    """The residual over one axis with its 95 % band."""
    if name == "heading":
        return compass(curve, most)
    axis, labels = axis_of(name), []
    if not axis.unit:
        labels = [str(x) for x in curve["before"].x]
    places = {
        kind: np.arange(float(len(labels))) if labels else _scaled(bins, axis.scale)
        for kind, bins in curve.items()
    }
    xs = places["before"]
    room = (-0.5, len(labels) - 0.5) if labels else (float(xs.min()), float(xs.max()))
    axes = Axes(*_SMALL, room, (-most, most), dict(enumerate(labels)) or None)
    parts = [axes.frame(axis.label, RESIDUAL)]
    for kind, bins in curve.items():
        xs, (low, high) = places[kind], bins.interval
        if labels:
            xs = xs + (0.08 if kind == "after" else -0.08)
            parts.append(axes.whiskers(xs, low, high, kind))
        else:
            parts.append(axes.area(xs, low, high, f"{kind} area"))
            parts.append(axes.line(xs, bins.bias, f"{kind} line"))
        if labels or len(xs) < _FEW:
            parts.append(axes.dots(xs, bins.bias, kind))
    return axes.svg(joined(*parts), f"Residual over {axis.words}", _in_words(axis, curve))


def _scaled(bins: Bins, scale: float) -> Array:
    return np.array(bins.x, float) * scale


def compass(curve: Curve, most: float) -> Markup:
    """The residual over the direction of travel, forward up: outside the ring it needs more."""
    width, height, radius = 350, 350, 128.0
    cx, cy = width / 2, height / 2 + 2

    def away(value: float) -> float:
        return radius * (0.56 + 0.44 * min(max(value / most, -1.0), 1.0))

    def place(angle: float, value: float) -> tuple[float, float]:
        return cx - away(value) * math.sin(angle), cy - away(value) * math.cos(angle)

    def ring(angles: Array, values: Array) -> str:
        places = map(place, angles, values)
        return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in places) + "Z"

    parts, numbers = [], []
    for value in nice_ticks(-most, most, count=4):
        parts.append(circle(cx, cy, away(value), "grid" if value else "zero"))
        numbers.append(text(*place(-2.2, value), f"{value:+g}" if value else "0", "halo"))
    for angle, word, anchor in (
        (0.0, "forward", "middle"),
        (math.pi / 2, "left", "end"),
        (math.pi, "backward", "middle"),
        (-math.pi / 2, "right", "start"),
    ):
        x, y = cx - 1.06 * radius * math.sin(angle), cy - 1.08 * radius * math.cos(angle) + 4
        parts.append(text(x, y, word, anchor=anchor))
    arrow = f"M{cx} {cy - 11}l7 18l-7 -5l-7 5Z"
    parts.append(element("path", d=arrow, kind="noise solid"))
    parts.append(text(width, height, RESIDUAL, "label", "end"))
    for kind, bins in curve.items():
        angles, (low, high) = np.array(bins.x, float), bins.interval
        gaps = np.diff(np.append(angles, angles[0] + 2 * math.pi))
        if len(angles) > _FEW and float(gaps.max()) < 0.6:
            band = ring(angles, high) + ring(angles[::-1], low[::-1])
            parts.append(element("path", d=band, fill_rule="evenodd", kind=f"{kind} area"))
            parts.append(element("path", d=ring(angles, bins.bias), kind=f"{kind} line"))
            continue
        for angle, a, b, value in zip(angles, low, high, bins.bias, strict=True):
            parts.append(line(*place(angle, a), *place(angle, b), f"{kind} line"))
            parts.append(circle(*place(angle, value), 3.4, f"{kind} solid"))
    said = _in_words(axis_of("heading"), curve)
    title = "Residual over the direction of travel"
    return chart(width, height + 6, joined(*parts, *numbers), title, said)


def shape_chart(
    axis_name: str, points: Sequence[tuple[float, float]], lacking: Bins | None
) -> Markup:
    """The proposed formula along its quantity, over what the model lacks without it."""
    axis = axis_of(axis_name)
    xs, ys = np.array(points, float).reshape(-1, 2).T
    xs = xs * axis.scale
    shown = [ys] if lacking is None else [ys, lacking.bias]
    values = np.concatenate([*shown, [0.0]])
    limits = (-180.0, 180.0) if axis_name == "heading" else (float(xs.min()), float(xs.max()))
    names = _COMPASS if axis_name == "heading" else None
    axes = Axes(460, 280, limits, padded(float(values.min()), float(values.max()), 0.12), names)
    parts = [axes.frame(axis.label, "what is missing (W)")]
    if lacking is not None:
        places = _scaled(lacking, axis.scale)
        inside = (places >= limits[0]) & (places <= limits[1])
        low, high = (ends[inside] for ends in lacking.interval)
        parts.append(axes.whiskers(places[inside], low, high, "before"))
        parts.append(axes.dots(places[inside], lacking.bias[inside], "before"))
    # Where the log has no rows the formula's curve is not known to hold: the line breaks.
    gaps = np.flatnonzero(np.diff(xs) > 0.08 * (limits[1] - limits[0])) + 1
    for piece in np.split(np.arange(len(xs)), gaps):
        draw = axes.line(xs[piece], ys[piece], "after line")
        parts.append(draw if len(piece) > 1 else axes.dots(xs[piece], ys[piece], "after"))
    said = "Dots: the log, with 95 % intervals. Line: the formula, median of its rows there."
    return axes.svg(joined(*parts), f"What is missing, over {axis.words}", said)


def claim_chart(curve: ResidualCurve) -> Markup:
    """The residual over the quantity that a claim follows, and what everything claimed changes."""
    axis = axis_of(curve.quantity)
    labels = [] if axis.unit else [str(x) for x in curve.x]
    xs = np.arange(float(len(labels))) if labels else axis.scale * np.array(curve.x, float)
    reach = SURE * np.nan_to_num(curve.stderr)
    low, high = curve.missing - reach, curve.missing + reach
    fitted = curve.fitted
    values = np.concatenate([low, high, np.zeros(1), *([] if fitted is None else [fitted])])
    limits = (-180.0, 180.0) if curve.quantity == "heading" else padded(xs.min(), xs.max(), 0.03)
    names: Mapping[float, str] | None = dict(enumerate(labels)) or None
    if curve.quantity == "heading":
        names = _COMPASS
    if labels:
        limits = (-0.5, len(labels) - 0.5)
    axes = Axes(460, 280, limits, padded(float(values.min()), float(values.max()), 0.08), names)
    parts = [axes.frame(axis.label, RESIDUAL)]
    if fitted is not None:
        parts.append(
            axes.dots(xs, fitted, "after", 5.5) if labels else axes.line(xs, fitted, "after line")
        )
    parts += [axes.whiskers(xs, low, high, "before"), axes.dots(xs, curve.missing, "before")]
    said = "Dots: measured minus predicted in this log, with 95 % intervals."
    if fitted is not None:
        said += " Line: what the claim changes."
    return axes.svg(joined(*parts), f"Residual over {axis.words}", said)


def _in_words(axis: Axis, curve: Curve) -> str:
    """The chart for those who cannot see it."""
    bins = curve["before"]

    def at(place: int) -> str:
        x = bins.x[place]
        where = f"{float(x) * axis.scale:.3g} {axis.unit}" if axis.unit else x
        return f"{signed(float(bins.bias[place]))} at {where}"

    said = f"From {at(int(np.argmin(bins.bias)))} to {at(int(np.argmax(bins.bias)))}"
    if "after" in curve:
        most = watts(float(np.abs(curve["after"].bias).max()))
        said += f"; with what is proposed at most {most} off"
    return f"{said}. Positive: {axis.meaning}." if axis.unit else f"{said}."
