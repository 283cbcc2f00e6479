"""A diagnosis's evidence for a terminal: errors, worst stretch, curve, shares of the error.

for part in evidence(document): console.print(part)

Everywhere ``o`` is what was measured and ``+`` what is claimed; ``⊕`` is both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Literal

from planner.amounts import share, signed, watts
from planner.report.workbench_wording import Document, proposed, run_name

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

MEASURED, CLAIMED, BOTH, MODEL = "o", "+", "⊕", "·"
_BAR = 40
"""Characters of the longest bar."""
_STRIP = 25
"""Characters of a strip with marks on it."""
_WIDE, _HIGH = 66, 11
"""Characters and lines of a chart, at most."""


def evidence(document: Document) -> Iterator[RenderableType]:
    """What a person looks at to believe a diagnosis, most telling first."""
    yield errors(document)
    pictures = document.get("pictures") or {}
    named = " + ".join(claims(document))
    if stretch := pictures.get("stretch"):
        yield over_time(stretch, named)
    # Where nothing is missing the residual is noise over every quantity.
    if document["verdict"] != "complete":
        # The page has all of them.
        for curve in pictures.get("curves", ())[:1]:
            yield over_quantity(curve, named)
    if shares := pictures.get("shares"):
        yield by_regime(shares)


def claims(document: Document) -> list[str]:
    """Names of what a diagnosis claims: sensors that are wrong, effects and a formula."""
    return [*(f"{s['kind']} corrected" for s in document.get("sensor") or ()), *proposed(document)]


def errors(document: Document) -> RenderableType:
    """Errors on unseen runs as bars, and the noise."""
    before, after = document["baseline"], document.get("after") or {}
    sizes = {"model as it is": before["heldout_rmse_w"]}
    if (named := claims(document)) and after:
        sizes[f"with {' + '.join(named)}"] = after["heldout_rmse_w"]
    sizes["the log's own noise, about"] = before["noise_floor_w"]
    most = max(*sizes.values(), 1e-12)
    rows = [
        (name, watts(size), "█" * max(round(_BAR * size / most), 1)) for name, size in sizes.items()
    ]
    return _plain("Error on runs that the fit has not seen (root mean square)", rows)


def over_time(stretch: Document, named: str) -> RenderableType:
    """Measured and predicted power of a stretch, as letters."""
    from rich.text import Text

    time = stretch["time_s"]
    series = {MODEL: stretch["predicted_w"], MEASURED: stretch["measured_w"]}
    if stretch["proposed_w"] is not None:
        series[CLAIMED] = stretch["proposed_w"]
    claimed = f", {CLAIMED} with {named}" if CLAIMED in series else ""
    title = (
        f"Where the model errs most: {run_name(stretch['run'])}, "
        f"{time[0]:.0f} to {time[-1]:.0f} s\n{MEASURED} measured, {MODEL} model as it is{claimed}"
        + (f", {BOTH} both" if claimed else "")
    )
    lines = _plot(series)
    return Text("\n".join([title, *lines]), no_wrap=True, overflow="crop")


def over_quantity(curve: Document, named: str) -> RenderableType:
    """What the model misses over one quantity, bin by bin, and what is claimed there."""
    from planner.report.workbench import axis_of

    axis = axis_of(curve["quantity"])
    missing, fitted = curve["missing_w"], curve["fitted_w"]
    low, high = min(0.0, *missing, *(fitted or ())), max(0.0, *missing, *(fitted or ()))
    rows = []
    for k, x in enumerate(curve["x"]):
        place = x if isinstance(x, str) else _place(axis.scale * x)
        error = curve["stderr_w"][k]
        said = _bare(missing[k]) + ("" if error is None else f" ± {_bare(error).lstrip('+')}")
        marks = {MEASURED: missing[k]} | ({} if fitted is None else {CLAIMED: fitted[k]})
        adds = () if fitted is None else (_bare(fitted[k]),)
        rows.append((place, f"{curve['rows'][k]:,}", said, *adds, _strip(marks, low, high)))
    heads = [axis.label, "rows", f"{MEASURED} residual (W)"]
    if fitted is not None:
        heads.append(f"{CLAIMED} claim (W)")
    heads.append(f"{_tick(low)} to {_tick(high)}")
    what = f", and what {named} changes" if fitted is not None else ""
    title = f"Residual (measured − predicted) over {axis.words}{what}"
    return _plain(title, rows, heads, right=len(heads) - 1)


def by_regime(shares: Sequence[Document]) -> RenderableType:
    """Which rows the squared error is in."""
    rows = [
        (
            s["where"],
            f"{s['rows']:,}",
            share(s["share_of_rows"]),
            share(s["share_of_squared_error"]),
            signed(s["bias_w"]),
        )
        for s in shares
    ]
    heads = ["where", "rows", "of the rows", "of the squared error", "measured − predicted"]
    title = "Where the squared error is (a row counts in the first line that it fits)"
    return _plain(title, rows, heads, right=len(heads))


def _plain(
    title: str, rows: Sequence[Sequence[str]], heads: Sequence[str] = (), right: int = 2
) -> Table:
    """A table without lines; the columns from the second up to ``right`` are right-justified."""
    from rich.table import Table

    table = Table(
        title=title,
        title_justify="left",
        title_style="italic",
        box=None,
        show_header=bool(heads),
        header_style="bold",
        pad_edge=False,
        padding=(0, 2, 0, 0),
    )
    for number in range(len(rows[0])):
        head = heads[number] if heads else ""
        justify: Literal["left", "right"] = "right" if 0 < number < right else "left"
        table.add_column(head, justify=justify, no_wrap=number > 0)
    for row in rows:
        table.add_row(*row)
    return table


def _strip(marks: Mapping[str, float], low: float, high: float) -> str:
    """Marks on a line from low to high; zero is an upright stroke."""
    span = (high - low) or 1.0

    def place(value: float) -> int:
        return round((_STRIP - 1) * (value - low) / span)

    line = [" "] * _STRIP
    line[place(0.0)] = "│"
    for mark, value in marks.items():
        at = place(value)
        line[at] = BOTH if line[at] == MEASURED else mark
    return "".join(line)


def _plot(series: Mapping[str, Sequence[float]]) -> list[str]:
    """Lines of a plot: a letter for each series, later ones above earlier ones."""
    count = len(next(iter(series.values())))
    columns = min(_WIDE, count)
    means = {}
    for mark, values in series.items():
        edges = [count * k // columns for k in range(columns + 1)]
        means[mark] = [
            sum(values[a:b]) / (b - a) for a, b in zip(edges[:-1], edges[1:], strict=True)
        ]
    low = min(map(min, means.values()))
    high = max(map(max, means.values()))
    span = (high - low) or 1.0
    canvas = [[" "] * columns for _ in range(_HIGH)]
    for mark, values in means.items():
        for column, value in enumerate(values):
            row = round((_HIGH - 1) * (high - value) / span)
            there = canvas[row][column]
            canvas[row][column] = BOTH if (there, mark) == (MEASURED, CLAIMED) else mark
    ticks = {0: _tick(high), _HIGH - 1: _tick(low)}
    if low < 0.0 < high:
        ticks.setdefault(round((_HIGH - 1) * high / span), _tick(0.0))
    return [f"{ticks.get(k, ''):>9} │{''.join(line).rstrip()}" for k, line in enumerate(canvas)]


def _place(value: float) -> str:
    """A value of a quantity, with two figures or as a whole number."""
    said = f"{value:z,.0f}" if abs(value) >= 99.5 else f"{value:z.2g}"
    return said.replace("-", "−")


def _bare(value: float) -> str:
    """Watts with a sign and without their unit."""
    return signed(value).removesuffix(" W")


def _tick(value: float) -> str:
    return f"{value:z.3g} W".replace("-", "−")
