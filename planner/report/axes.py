"""Axes of all charts and maps: numbers to pixels, the frame, and marks within it.

    axes = Axes(430, 330, (0.0, 1.2), (0.0, 80.0))
    axes.svg(axes.frame("speed (m/s)", "power (W)") + axes.line(speed, watts, "route"), "Power")

Charts of bars use the level axis alone and give the frame's place as ``inner``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.arrays import Array
from planner.report.drawing import chart, circle, line, rectangle, shortened, text, width_of
from planner.report.markup import Markup, element, joined

Range = tuple[float, float]

LEFT, RIGHT, TOP, BOTTOM = 52, 12, 10, 26
"""Pixels around a frame, more where numbers are long."""
_LABEL = 17  # pixels of the upright axis's label


def nice_ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round numbers from low to high, about ``count`` of them."""
    span = high - low
    if not span > 0:
        return [low]
    raw = span / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1, 2, 2.5, 5, 10) if m * power >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def tick_words(ticks: Sequence[float]) -> list[str]:
    """Ticks written with the digits of their step, so that neighbours differ; zero has no sign."""
    step = min((b - a for a, b in itertools.pairwise(ticks)), default=0.0)
    if step <= 0:
        return [f"{value:zg}" for value in ticks]
    power = math.floor(math.log10(step) + 1e-9)
    # Steps of 2.5 have a digit more.
    digits = max(0, -power + (abs(step / 10.0**power - 2.5) < 1e-6))
    return [f"{value:z.{digits}f}" for value in ticks]


def padded(low: float, high: float, share: float = 0.08, least: float = 1e-6) -> Range:
    """A range with some room at both ends, at least ``least``."""
    room = max(share * (high - low), least)
    return low - room, high + room


def thinned(count: int, most: int = 1200) -> NDArray[np.int64]:
    """At most ``most`` of ``count`` indices, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


@dataclass(frozen=True)
class Axes:
    """Maps a chart's numbers to its pixels.

    Attributes:
        width, height: pixels, without what stands below.
        x_range, y_range: the numbers at the ends.
        names: stand at their places instead of numbers on the level axis.
        unit: stands behind each number of the upright axis.
        size: pixels of the letters.
        inner: left, top, right and bottom of the frame in pixels; None leaves room for numbers.
    """

    width: float
    height: float
    x_range: Range
    y_range: Range = (0.0, 1.0)
    names: Mapping[float, str] | None = None
    unit: str = ""
    size: float = 11.0
    inner: tuple[float, float, float, float] | None = None

    @cached_property
    def x_ticks(self) -> dict[float, str]:
        """Words below the frame by the number at which they stand."""
        if self.names is not None:
            room = (self.width - LEFT - RIGHT) / max(len(self.names), 1)
            return {place: shortened(name, room) for place, name in self.names.items()}
        ticks = nice_ticks(*self.x_range, count=max(3, min(8, int(self.width) // 70)))
        return dict(zip(ticks, tick_words(ticks), strict=True))

    @cached_property
    def y_ticks(self) -> dict[float, str]:
        """Words left of the frame by the number at which they stand."""
        ticks = nice_ticks(*self.y_range, count=4)
        return {at: words + self.unit for at, words in zip(ticks, tick_words(ticks), strict=True)}

    @cached_property
    def left(self) -> float:
        """Pixels left of the frame: the label, which stands upright, and the numbers."""
        if self.inner is not None:
            return self.inner[0]
        widest = max((width_of(words, self.size) for words in self.y_ticks.values()), default=0.0)
        return max(float(LEFT), _LABEL + widest + 6.0)

    @cached_property
    def right(self) -> float:
        """Pixel at which the frame ends: half of a number fits beyond."""
        if self.inner is not None:
            return self.inner[2]
        last = [*self.x_ticks.values()][-1:]
        named = self.names is not None and max(self.names, default=0.0) < self.x_range[1]
        halves = [] if named else [0.5 * width_of(words, self.size) for words in last]
        return self.width - max([float(RIGHT), *halves])

    @property
    def top(self) -> float:
        """Pixel at which the frame begins."""
        return float(TOP) if self.inner is None else self.inner[1]

    @property
    def bottom(self) -> float:
        """Pixel at which the frame ends: numbers stand below."""
        return float(self.height - BOTTOM) if self.inner is None else self.inner[3]

    def x(self, value: Array | float) -> Any:
        """Pixels from the left; a number for a number."""
        low, high = self.x_range
        inner = self.right - self.left
        return self.left + (np.asarray(value, float) - low) / (high - low or 1.0) * inner

    def y(self, value: Array | float) -> Any:
        """Pixels from the top; a number for a number."""
        low, high = self.y_range
        inner = self.bottom - self.top
        return self.top + (high - np.asarray(value, float)) / (high - low or 1.0) * inner

    def points(self, xs: Array, ys: Array) -> str:
        """A polyline's points."""
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(self.x(xs), self.y(ys), strict=True))

    # Marks within the frame.

    def line(self, xs: Array, ys: Array, kind: str) -> Markup:
        """A line."""
        return element("polyline", points=self.points(xs, self._inside(ys)), kind=kind)

    def area(self, xs: Array, low: Array, high: Array, kind: str = "", **further: Any) -> Markup:
        """What lies between two lines."""
        low, high = self._inside(low), self._inside(high)
        outline = f"{self.points(xs, high)} {self.points(xs[::-1], low[::-1])}"
        return element("polygon", points=outline, kind=kind, **further)

    def dots(self, xs: Array, ys: Array, kind: str, radius: float = 3.0) -> Markup:
        """Points large enough to be distinguished."""
        places = zip(self.x(xs), self.y(self._inside(ys)), strict=True)
        return joined(*(circle(x, y, radius, f"{kind} solid") for x, y in places))

    def cloud(self, xs: Array, ys: Array, kind: str) -> Markup:
        """Thousands of points as one path, which stays small."""
        known = np.isfinite(xs) & np.isfinite(ys)
        places = zip(self.x(xs[known]), self.y(self._inside(ys[known])), strict=True)
        path = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in places)
        return element("path", d=path, kind=f"{kind} points")

    def whiskers(self, xs: Array, low: Array, high: Array, kind: str) -> Markup:
        """Intervals as upright lines."""
        ends = (self.y(self._inside(values)) for values in (low, high))
        places = zip(self.x(xs), *ends, strict=True)
        return joined(*(line(x, a, x, b, f"{kind} line") for x, a, b in places))

    def bar(
        self,
        start: float,
        end: float,
        y: float,
        height: float,
        kind: str,
        rx: float = 2.0,
        **further: Any,
    ) -> Markup:
        """A level bar from one number to another; ``y``, ``height`` and ``rx`` are pixels."""
        a, b = sorted((self.x(start), self.x(end)))
        return rectangle(a, y, max(b - a, 1.0), height, kind, rx=rx, **further)

    def mark(self, value: float, top: float, bottom: float, kind: str) -> Markup:
        """An upright line at a number, between two pixels."""
        x = self.x(value)
        return line(x, top, x, bottom, kind)

    def _inside(self, ys: Array) -> Array:
        return np.clip(ys, *self.y_range)

    # The frame.

    def grid(self) -> Markup:
        """Level lines with their numbers."""
        parts = []
        for value, words in self.y_ticks.items():
            y = self.y(value)
            parts.append(line(self.left, y, self.right, y, "grid" if value else "zero"))
            parts.append(text(self.left - 6, y + 3.5, words, anchor="end"))
        return joined(*parts)

    def frame(self, x_label: str, y_label: str) -> Markup:
        """Grid, numbers and labels."""
        numbers = [
            text(self.x(value), self.height - 10, words, anchor="middle")
            for value, words in self.x_ticks.items()
        ]
        middle = (self.top + self.bottom) / 2
        upright = f"translate(11 {middle:.0f}) rotate(-90)"
        return joined(
            self.grid(),
            *numbers,
            text(0, 0, y_label, "label", "middle", transform=upright),
            text(self.right, self.height + 3, x_label, "label", "end"),
        )

    def svg(self, content: str, title: str, description: str = "") -> Markup:
        """The finished chart; the description is for those who cannot see it."""
        (x0, x1), (y0, y1) = self.x_range, self.y_range
        return chart(
            self.width,
            self.height + 7,
            content,
            title,
            description,
            data_range=f"{x0},{x1},{y0},{y1}",
            data_inner=f"{self.left:.1f},{self.top:.0f},{self.right:.1f},{self.bottom:.0f}",
        )
