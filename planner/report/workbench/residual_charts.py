"""Charts of a residual: predicted against measured, over time, over each axis, around the compass.

Watts are measured minus predicted: above zero the robot needs more than the model says. Amber is
the model at the start, teal the one that was proposed or made.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from planner.amounts import signed, watts
from planner.arrays import Array
from planner.report.axes import Axes, nice_ticks, padded
from planner.report.drawing import chart
from planner.report.workbench.residuals import SURE, Bins, Curve, Look, Stretch, axis_of

RESIDUAL = "measured − predicted (W)"
_FEW = 8  # bins from which on a curve needs no dots
_SMALL = (350, 215)
_COMPASS = {-180.0: "back", -90.0: "right", 0.0: "forward", 90.0: "left", 180.0: "back"}


def cloud(look: Look) -> str:
    """Predicted against measured power of rows spread over the log."""
    shown = [look.measured, look.before, *([] if look.after is None else [look.after])]
    low, high = (float(f(v)) for f, v in ((np.min, np.concatenate(shown)), (np.max, shown[0])))
    limits = padded(low, max(high, float(np.quantile(np.concatenate(shown), 0.999))), 0.03)
    axes = Axes(430, 330, limits, limits)
    ends = np.array(limits)
    parts = [axes.frame("measured (W)", "predicted (W)"), axes.line(ends, ends, "zero")]
    parts.append(axes.cloud(look.measured, look.before, "before"))
    if look.after is not None:
        parts.append(axes.cloud(look.measured, look.after, "after"))
    said = f"{len(look.measured):,} rows; on the diagonal prediction and measurement agree."
    return axes.svg("".join(parts), "Predicted against measured power", said)


def distribution(look: Look, floor: float) -> str:
    """How often which error occurs, beside the log's own noise."""
    before, after = look.residual_before, look.residual_after
    widest = np.quantile(np.abs(before), 0.995)
    limit = float(max(widest, 3.0 * floor, 1e-6))
    edges = np.linspace(-limit, limit, 61)
    width = edges[1] - edges[0]
    middle = 0.5 * (edges[1:] + edges[:-1])

    def share(values: Array) -> Array:
        count, _ = np.histogram(values, edges)
        density: Array = count / (max(len(values), 1) * width)
        return density

    heights = [share(before), *([] if after is None else [share(after)])]
    top = float(max(h.max() for h in heights))
    spread = max(floor, width)  # a log without noise would be one infinite line
    noise = np.exp(-0.5 * (middle / spread) ** 2) / (spread * math.sqrt(2 * math.pi))
    axes = Axes(430, 330, (-limit, limit), (0.0, 1.08 * max(top, float(noise.max()))))
    xs = np.repeat(edges, 2)[1:-1]
    parts = [axes.frame(RESIDUAL, "share of the rows per watt")]
    for kind, values in zip(("before", "after"), heights, strict=False):
        ys = np.repeat(values, 2)
        parts += [
            axes.area(xs, np.zeros_like(ys), ys, kind),
            axes.line(xs, ys, f"{kind} thin"),
        ]
    parts.append(axes.line(middle, noise, "noise dashed"))
    said = "Dashed: how the errors of a model that lacks nothing would be spread."
    return axes.svg("".join(parts), "How large the errors are", said)


def over_time(stretch: Stretch) -> str:
    """Measured and predicted power in the stretch in which the model at the start errs most."""
    lines = [("measured", stretch.measured), ("before", stretch.before)]
    lines += [] if stretch.after is None else [("after", stretch.after)]
    values = np.concatenate([ys for _, ys in lines])
    axes = Axes(
        1000, 250, (float(stretch.time[0]), float(stretch.time[-1])),
        padded(float(values.min()), float(values.max())),
    )  # fmt: skip
    kinds = {"measured": "measured broad", "before": "before thin", "after": "after thin"}
    parts = [axes.frame("time since the start of the run (s)", "power (W)")]
    parts += [axes.line(stretch.time, ys, kinds[name]) for name, ys in lines]
    return axes.svg("".join(parts), f"Power over time in {stretch.run}")


def common_range(curves: Sequence[Curve]) -> float:
    """W that all charts of a page reach, so that axes can be compared."""
    sizes = [np.abs(c.before.bias) + np.nan_to_num(c.before.stderr) for c in curves]
    # One bin of few rows must not make everything else flat.
    largest = [float(np.quantile(s, 0.97)) for s in sizes] or [0.0]
    return max(*largest, 1e-3) * 1.15


def residual_chart(curve: Curve, most: float) -> str:
    """The residual over one axis with its 95 % band."""
    if curve.axis == "heading":
        return compass(curve, most)
    axis = axis_of(curve.axis)
    labels = [str(x) for x in curve.before.x] if not axis.unit else []
    xs = np.arange(len(labels), dtype=float) if labels else _scaled(curve.before, axis.scale)
    room = (-0.5, len(labels) - 0.5) if labels else (float(xs.min()), float(xs.max()))
    axes = Axes(*_SMALL, room, (-most, most), dict(enumerate(labels)) or None)
    parts = [axes.frame(axis.label, RESIDUAL)]
    for kind, bins in (("before", curve.before), ("after", curve.after)):
        if bins is None:
            continue
        places = xs if labels else _scaled(bins, axis.scale)
        reach = SURE * np.nan_to_num(bins.stderr)
        if labels:
            places = places + (0.08 if kind == "after" else -0.08)
            parts.append(axes.whiskers(places, bins.bias - reach, bins.bias + reach, kind))
        else:
            parts.append(axes.area(places, bins.bias - reach, bins.bias + reach, kind))
            parts.append(axes.line(places, bins.bias, f"{kind} line"))
        if labels or len(places) < _FEW:
            parts.append(axes.dots(places, bins.bias, kind))
    return axes.svg("".join(parts), f"Residual over {axis.words}", _in_words(curve))


def _scaled(bins: Bins, scale: float) -> Array:
    return np.array(bins.x, float) * scale


def compass(curve: Curve, most: float) -> str:
    """The residual over the direction of travel, forward up: outside the ring it needs more."""
    width, height, radius = 350, 350, 128.0
    middle = (width / 2, height / 2 + 2)

    def place(angle: float, value: float) -> tuple[float, float]:
        away = radius * (0.56 + 0.44 * min(max(value / most, -1.0), 1.0))
        return middle[0] - away * math.sin(angle), middle[1] - away * math.cos(angle)

    def ring(angles: Array, values: Array) -> str:
        places = (place(float(a), float(v)) for a, v in zip(angles, values, strict=True))
        return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in places) + "Z"

    parts, numbers = [], []
    for value in nice_ticks(-most, most, count=4):
        away = radius * (0.56 + 0.44 * value / most)
        x, y = place(-2.2, value)
        parts.append(
            f'<circle cx="{middle[0]}" cy="{middle[1]}" r="{away:.1f}" '
            f'class="{"zero" if value == 0 else "grid"}"/>'
        )
        number = f"{value:+g}" if value else "0"
        numbers.append(f'<text x="{x:.1f}" y="{y:.1f}" class="halo">{number}</text>')
    for angle, word, anchor in (
        (0.0, "forward", "middle"),
        (math.pi / 2, "left", "end"),
        (math.pi, "backward", "middle"),
        (-math.pi / 2, "right", "start"),
    ):
        x, y = place(angle, 1.1 * most)
        x, y = middle[0] + (x - middle[0]) * 1.06, middle[1] + (y - middle[1]) * 1.08 + 4
        parts.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{word}</text>')
    cx, cy = middle
    parts.append(
        f'<path d="M{cx} {cy - 11}l7 18l-7 -5l-7 5Z" class="noise solid"/>'
        f'<text x="{width}" y="{height}" text-anchor="end" class="label">{RESIDUAL}</text>'
    )
    for kind, bins in (("before", curve.before), ("after", curve.after)):
        if bins is None:
            continue
        angles = np.array(bins.x, float)
        reach = SURE * np.nan_to_num(bins.stderr)
        low, high = bins.bias - reach, bins.bias + reach
        gaps = np.diff(np.append(angles, angles[0] + 2 * math.pi))
        if len(angles) > _FEW and float(gaps.max()) < 0.6:
            band = ring(angles, high) + ring(angles[::-1], low[::-1])
            parts.append(f'<path d="{band}" fill-rule="evenodd" class="{kind} area"/>')
            parts.append(f'<path d="{ring(angles, bins.bias)}" class="{kind} line"/>')
            continue
        for angle, a, b, value in zip(angles, low, high, bins.bias, strict=True):
            (x0, y0), (x1, y1) = place(angle, float(a)), place(angle, float(b))
            x, y = place(angle, float(value))
            parts.append(
                f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" '
                f'class="{kind} line"/><circle cx="{x:.1f}" cy="{y:.1f}" r="3.4" '
                f'class="{kind} solid"/>'
            )
    title = "Residual over the direction of travel"
    return chart(width, height + 6, "".join(parts + numbers), title, _in_words(curve))


def shape_chart(axis_name: str, points: Sequence[tuple[float, float]], lacking: Bins | None) -> str:
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
        places, bias = places[inside], lacking.bias[inside]
        reach = SURE * np.nan_to_num(lacking.stderr[inside])
        parts += [
            axes.whiskers(places, bias - reach, bias + reach, "before"),
            axes.dots(places, bias, "before"),
        ]
    # Where the log has no rows the formula's curve is not known to hold: the line breaks.
    gaps = np.flatnonzero(np.diff(xs) > 0.08 * (limits[1] - limits[0])) + 1
    for piece in np.split(np.arange(len(xs)), gaps):
        draw = axes.line(xs[piece], ys[piece], "after line")
        parts.append(draw if len(piece) > 1 else axes.dots(xs[piece], ys[piece], "after"))
    said = "Dots: the log, with 95 % intervals. Line: the formula, median of its rows there."
    return axes.svg("".join(parts), f"What is missing, over {axis.words}", said)


def _in_words(curve: Curve) -> str:
    """The chart for those who cannot see it."""
    axis, bins = axis_of(curve.axis), curve.before
    low, high = int(np.argmin(bins.bias)), int(np.argmax(bins.bias))

    def at(place: int) -> str:
        x = bins.x[place]
        where = x if not axis.unit else f"{float(x) * axis.scale:.3g} {axis.unit}"
        return f"{signed(float(bins.bias[place]))} at {where}"

    said = f"From {at(low)} to {at(high)}"
    if curve.after is not None:
        said += (
            f"; with what is proposed at most {watts(float(np.abs(curve.after.bias).max()))} off"
        )
    return f"{said}. Positive: {axis.meaning}." if axis.unit else f"{said}."
