"""Bars of the workbench: errors against the noise, regimes, candidates, energy by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from planner.amounts import share, signed, watts
from planner.report.axes import Axes
from planner.report.drawing import chart, circle, line, short, shortened, text, width_of
from planner.report.markup import joined
from planner.report.workbench.residuals import SURE
from planner.telemetry.comparison import RunComparison
from planner.telemetry.diagnosis import Candidate
from planner.telemetry.pictures import Share
from planner.telemetry.regimes import Regime

MOST_CANDIDATES = 10
"""Best candidates that a chart shows; the page's table has all."""
MOST_RUNS = 24
"""Runs with the largest errors that a chart shows."""


def errors_chart(errors: Mapping[str, float], floor: float) -> str:
    """Held-out errors as bars; the first is the model at the start. Noise is a line.

    Args:
        errors: what it is of → W.
        floor: W that no model can go below, about.
    """
    width, row, room = 440, 44, 90
    most = max(*errors.values(), floor, 1e-9)
    end = 14 + row * len(errors)

    axes = Axes(width, end, (0.0, most), inner=(0.0, 8.0, width - room, end + 4.0))
    parts = [axes.bar(0.0, floor, 8, end - 4, "noise area")]
    for number, (name, value) in enumerate(errors.items()):
        y, kind = 12 + row * number, "after" if number else "before"
        parts.append(text(4, y + 11, shortened(name, width - 8.0, 13.0), "ink halo"))
        parts.append(
            axes.bar(0.0, value, y + 17, 16, f"{kind} solid", tooltip=f"{name}: {watts(value)}")
        )
        parts.append(text(axes.x(value) + 8, y + 30, watts(value), "strong halo"))
    parts.append(axes.mark(floor, 8, end + 6, "noise dashed"))
    floor_text = f"the log's own noise, about {watts(floor)}"
    anchor = "end" if axes.x(floor) > 0.6 * width else ""
    parts.append(text(axes.x(floor), end + 20, floor_text, anchor=anchor))
    said = "; ".join(f"{name} {watts(value)}" for name, value in errors.items())
    title = "Error on held-out runs against the log's own noise"
    return chart(
        width, end + 28, joined(*parts), title, f"{said}; {floor_text}.", kind="chart bars small"
    )


def regimes_chart(regimes: Sequence[Regime]) -> str:
    """Where the model is wrong: bias with its 95 % interval, and its share of the squared error."""
    if not regimes:
        return ""
    width, row, split = 640, 46, 430
    low = min(0.0, *(r.bias_w - SURE * r.stderr_w for r in regimes))
    high = max(0.0, *(r.bias_w + SURE * r.stderr_w for r in regimes))
    end = 24 + row * len(regimes)
    axes = Axes(width, end, (low, high), inner=(6.0, 24.0, split - 84.0, end))
    shares = Axes(width, end, (0.0, 1.0), inner=(split, 24.0, split + 150.0, end))
    parts = [text(0, 12, "measured − predicted"), text(split, 12, "share of the squared error")]
    for number, r in enumerate(regimes):
        y = 24 + row * number
        parts.append(text(0, y + 14, short(r.where, 96), "ink halo"))
        parts.append(axes.bar(0.0, r.bias_w, y + 20, 14, "before solid", tooltip=r.sentence))
        parts.append(axes.mark(0.0, y + 17, y + 37, "zero"))
        reach = SURE * r.stderr_w
        a, b = (axes.x(r.bias_w + side * reach) for side in (-1.0, 1.0))
        parts.append(line(a, y + 27, b, y + 27, "measured thin"))
        parts.append(text(max(b, axes.x(0.0)) + 6, y + 32, signed(r.bias_w), "strong halo"))
        part = min(max(r.share_of_squared_error, 0.0), 1.0)
        parts.append(shares.bar(0.0, 1.0, y + 20, 14, "noise area"))
        parts.append(shares.bar(0.0, part, y + 20, 14, "noise solid"))
        parts.append(text(split + 158, y + 32, share(r.share_of_squared_error), "strong"))
    said = "; ".join(r.sentence for r in regimes) + "."
    title = "Where the model is wrong"
    return chart(width, end + 4, joined(*parts), title, said, kind="chart bars")


def shares_chart(shares: Sequence[Share]) -> str:
    """Which rows hold the squared error: their share of the rows above their share of the error."""
    if not shares:
        return ""
    width, row, room = 460, 62, 190
    end = 4 + row * len(shares)
    axes = Axes(width, end, (0.0, 1.0), inner=(0.0, 4.0, width - room, end))
    parts = []
    for number, s in enumerate(shares):
        y = 4 + row * number
        parts.append(text(0, y + 13, shortened(s.where, width, 13.0), "ink halo"))
        rows = f"of the rows, {signed(s.bias_w)}"
        for down, part, kind, of in (
            (19, s.share_of_rows, "noise", rows),
            (35, s.share_of_squared_error, "before", "of the squared error"),
        ):
            words = f"{share(part)} {of}"
            parts.append(axes.bar(0.0, part, y + down, 13, f"{kind} solid", tooltip=words))
            parts.append(text(axes.x(part) + 8, y + down + 11, words, "strong halo"))
    said = "; ".join(
        f"{s.where}: {share(s.share_of_rows)} of the rows, "
        f"{share(s.share_of_squared_error)} of the squared error"
        for s in shares
    )
    return chart(
        width, end, joined(*parts), "Where the squared error is", said, kind="chart bars small"
    )


def candidates_chart(
    candidates: Mapping[str, Candidate],
    selected: Sequence[str],
    before: float,
    floor: float,
    likely: Mapping[str, str],
) -> str:
    """Probability of every candidate, and the held-out error that the model would have with it.

    Args:
        candidates: by slug, those to be shown, best first.
        selected: slugs.
        before: W, held-out error of the model without any of them.
        floor: W, noise.
        likely: slug → its probability in words; {} where probabilities are not told.
    """
    shown = [*candidates.values()][:MOST_CANDIDATES]
    if not shown:
        return ""
    width, row, names, full = 640, 26, 176, 90
    middle = 400 if likely else names
    known = [c.heldout_rmse_w for c in shown if c.heldout_rmse_w is not None]
    most = 1.02 * max([before, floor, *known])
    end = 30 + row * len(shown)

    axes = Axes(width, end, (0.0, most), inner=(middle, 24.0, width - 8.0, end))
    chances = Axes(width, end, (0.0, 1.0), inner=(names, 24.0, names + full, end))
    parts = [text(names, 12, "probability")] if likely else []
    if known:
        parts += [
            axes.bar(0.0, floor, 24, end - 24, "noise area"),
            axes.mark(floor, 20, end, "noise dashed"),
            axes.mark(before, 20, end, "before dashed"),
            text(middle, 12, "error on unseen runs with it"),
            text(axes.x(floor), end + 14, f"noise {watts(floor)}", anchor="middle"),
            text(axes.x(before), end + 30, f"without any {watts(before)}", anchor="end"),
        ]
    for number, c in enumerate(shown):
        y = 28 + row * number
        chosen = c.effect in selected
        parts.append(text(0, y + 14, short(c.effect, 26), "strong" if chosen else "ink"))
        hue = "after" if chosen else "noise"
        if likely:
            words = likely[c.effect]
            known_as = c.probability or 0.0 if words[-1:] == "%" else 0.0
            parts.append(chances.bar(0.0, known_as, y + 3, 14, f"{hue} solid"))
            parts.append(text(chances.x(known_as) + 6, y + 15, words, "ink"))
        if c.heldout_rmse_w is not None:
            kind = f"{hue} {'solid' if chosen else 'hollow'}"
            name = f"{c.effect}: {watts(c.heldout_rmse_w)}"
            parts.append(circle(axes.x(c.heldout_rmse_w), y + 10, 5.5, kind, tooltip=name))
    said = "; ".join(f"{c.effect} {likely.get(c.effect, '')}".rstrip() for c in shown) + "."
    title = "What could be missing"
    return chart(width, end + 38, joined(*parts), title, said, kind="chart bars")


def runs_chart(runs: Sequence[RunComparison]) -> str:
    """By how much the predicted energy of every run is off; of many those that are off most."""
    known = [r for r in runs if r.error_share is not None]
    worst = sorted(known, key=lambda r: -abs(r.error_share or 0.0))[:MOST_RUNS]
    shown = [r for r in known if r in worst]
    if len(shown) < 2:
        return ""
    width, row, names = 560, 20, 150
    most = max(abs(r.error_share or 0.0) for r in shown) or 1.0
    errors = [f"{100 * (r.error_share or 0.0):+z.1f} %".replace("-", "−") for r in shown]
    room = 8.0 + max(width_of(error, 13.0) for error in errors)
    middle, reach = names + (width - names) / 2, (width - names) / 2 - room
    end = 22 + row * len(shown)
    axes = Axes(width, end, (-most, most), inner=(middle - reach, 22.0, middle + reach, end))
    parts = [
        text(middle - 8, 12, "predicted too little", anchor="end"),
        text(middle + 8, 12, "predicted too much"),
    ]
    for number, (r, error) in enumerate(zip(shown, errors, strict=True)):
        off, y = r.error_share or 0.0, 22 + row * number
        parts.append(text(names - 8, y + 12, short(r.run, 18), "ink", "end"))
        parts.append(axes.bar(0.0, off, y + 2, 12, "before solid", tooltip=f"{r.run}: {error}"))
        side, anchor = (-6, "end") if off < 0 else (6, "")
        parts.append(text(axes.x(off) + side, y + 12, error, anchor=anchor))
    parts.append(axes.mark(0.0, 18, end, "zero"))
    title = "Error of the predicted energy by run"
    said = "; ".join(f"{r.run} {error}" for r, error in zip(shown, errors, strict=True)) + "."
    return chart(width, end + 4, joined(*parts), title, said, kind="chart bars")
