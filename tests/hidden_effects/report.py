"""The benchmark of naming as a page of the documentation and a picture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.hidden_effects.bars import METHOD_NAMES
from tests.hidden_effects.cases import EFFECTS, TWINS
from tests.hidden_effects.scoring import confidently_wrong

Row = dict[str, Any]

HEAD = """# How well missing effects are named

`python -m tests.benchmarks.naming` writes this page; `make bench` runs it, too. The
[virtual robot](virtual-robot.md) hides effects. A diagnosis gets the log, sometimes a mapping file,
and nothing else. The robot's base parameters differ from the vehicle's file by 3 to 15 %, so the
fit has to find them. The diagnosis has 4,800 rows of half a second; 2,400 rows of other runs are
for tests. Noise is 1 to 5 % of the power, part of it autocorrelated. All other columns have errors.
Some logs lack wheel currents, battery or acceleration.

*ρ* is the effect size: the rms of an effect's watts over the rms of the scatter. The part that a
refit of the base model absorbs is removed first. The scatter is the noise of the power, and the
error of the base model by errors of other columns and changes within a row. ρ comes from the robot
with and without the effect, not from the diagnosis. *Alias*: another effect of the catalogue
explains the watts to within five standard deviations of the scatter, or both are the same by
design. Naming both is then the right answer.

"""

WORDS = """
| outcome | meaning |
|---|---|
| exact | the selected effects are the hidden ones, no more and no less |
| tied | every selected effect is hidden, or reported as indistinguishable from a hidden one |
| not testable | nothing is selected; the hidden effect is listed as not testable in this log |
| part | some of several hidden effects, nothing wrong |
| missed | the hidden effect is not mentioned |
| confidently wrong | a name, a sensor or a shape that is not there, without the true one |
"""

COLOURS = {"exact": "#1b7f5c", "tied": "#8fbf5a", "not named": "#b9bec7", "wrong": "#c8402f"}


def document_text(document: Mapping[str, Any], rows: Sequence[Row]) -> str:
    """docs/naming.md."""
    parts = [HEAD, "## What must hold\n\n", _checks(document["checks"]), WORDS]
    parts += ["\n![Naming by visibility, and other methods](images/naming.svg)\n"]
    parts += ["\n## One hidden effect\n\n", _effects(rows)]
    parts += ["\n## By kind of log\n\n", _kinds(document["kinds"])]
    if document["methods"]:
        parts += ["\n## Other methods on the same logs\n\n", _methods(document["methods"])]
        parts += [
            "\nAll methods get the fitted base model, its residual and the same candidates. Their"
            "\npenalties are chosen on held-out runs: the sparsest within one standard error.\n"
        ]
    if document["not_right"]:
        parts += ["\n## Logs without the right answer\n\n```text\n"]
        parts += [f"{line}\n" for line in document["not_right"]]
        parts += ["```\n"]
    return "".join(parts)


def _table(head: Sequence[str], lines: Sequence[Sequence[Any]]) -> str:
    text = [" | ".join(head), "|".join("---" for _ in head)]
    text += [" | ".join(str(cell) for cell in line) for line in lines]
    return "".join(f"| {line} |\n" if "---" not in line else f"|{line}|\n" for line in text)


def _checks(found: Sequence[Mapping[str, Any]]) -> str:
    mark = {True: "yes", False: "**no**", None: "not run"}
    return _table(
        ["check", "bar", "found", "holds"],
        [(c["check"], c["bar"], c["found"].replace("|", "/"), mark[c["holds"]]) for c in found],
    )


def _effects(rows: Sequence[Row]) -> str:
    lines = []
    for slug in EFFECTS:
        mine = [r for r in rows if r["kind"] == "one" and r["group"] == slug]
        if not mine:
            continue
        count = Counter(row["outcome"] for row in mine)
        rho = [row["rho"][slug] for row in mine]
        twins = sorted({TWINS.get(slug) or row["rival"] for row in mine if row["twin"]})
        shown = min(rho) >= 0.005
        lines.append(
            (
                slug,
                len(mine),
                f"{min(rho):.2f} … {max(rho):.2f}" if shown else f"{max(rho):.2f} at most",
                count["exact"],
                count["tied"],
                count["not_testable"] + count["missed"],
                sum(confidently_wrong(row["outcome"]) for row in mine),
                f"{sum(row['twin'] for row in mine)} ({', '.join(twins)})" if twins else "",
                sum(not row["visible"] for row in mine) or "",
            )
        )
    head = ["effect", "logs", "ρ", "exact", "tied", "not named", "wrong", "aliased", "ρ < 0.3"]
    return _table(head, lines)


def _kinds(kinds: Mapping[str, Mapping[str, Any]]) -> str:
    return _table(
        ["kind", "logs", "right", "confidently wrong", "median s", "outcomes"],
        [
            (
                kind,
                entry["logs"],
                f"{entry['right']} ({entry['share']:.1%})",
                entry["confidently_wrong"],
                entry["median_seconds"],
                ", ".join(f"{count} {name}" for name, count in entry["outcomes"].items()),
            )
            for kind, entry in kinds.items()
        ],
    )


def _methods(figures: Mapping[str, Mapping[str, Any]]) -> str:
    def cell(entry: Mapping[str, Any], key: str) -> str:
        count, logs = entry[key]
        return f"{count} of {logs}"

    head = ["method", "one, exact", "two, exact", "false alarms", "false alarms, autocorrelated"]
    keys = ["exact_one", "exact_two", "false_alarms", "false_alarms_autocorrelated"]
    lines = [
        (METHOD_NAMES.get(method, method), *(cell(entry, key) for key in keys))
        for method, entry in figures.items()
    ]
    return _table(head, lines)


def draw(path: Path, rows: Sequence[Row], methods: Mapping[str, Mapping[str, Any]]) -> None:
    """SVG: outcomes by visibility, and other methods beside the diagnosis."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    matplotlib.rcParams["svg.hashsalt"] = "naming"
    matplotlib.rcParams["svg.fonttype"] = "none"
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.6), layout="constrained")
    _by_visibility(left, [r for r in rows if r["kind"] == "one" and not r["twin"]])
    _by_method(right, methods)
    figure.savefig(path, metadata={"Date": None, "Creator": None})
    plt.close(figure)


def _by_visibility(axes: Any, rows: Sequence[Row]) -> None:
    edges = [0.0, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, float("inf")]
    labels, shares = [], {name: [] for name in COLOURS}  # type: ignore[var-annotated]
    for low, high in zip(edges, edges[1:], strict=False):
        mine = [r for r in rows if low <= next(iter(r["rho"].values())) < high]
        if not mine:
            continue
        count: Counter[str] = Counter()
        for row in mine:
            outcome = row["outcome"]
            plain = "wrong" if confidently_wrong(outcome) or outcome == "error" else "not named"
            count[outcome if outcome in ("exact", "tied") else plain] += 1
        span = f"{low:g}–{high:g}" if high < 10.0 else f"> {low:g}"
        labels.append(f"{span}\n{len(mine)}")
        for name in COLOURS:
            shares[name].append(100.0 * count[name] / len(mine))
    bottom = [0.0] * len(labels)
    for name, colour in COLOURS.items():
        axes.bar(labels, shares[name], bottom=bottom, color=colour, label=name, width=0.75)
        bottom = [b + s for b, s in zip(bottom, shares[name], strict=True)]
    axes.tick_params(axis="x", labelsize=8)
    axes.set_xlabel("effect after projection / scatter; below it the number of logs")
    axes.set_ylabel("share of logs, %")
    axes.set_title("One hidden effect", loc="left")
    if labels:
        _legend_below(axes, 4)


def _by_method(axes: Any, methods: Mapping[str, Mapping[str, Any]]) -> None:
    keys = {
        "exact_one": "one effect, exact",
        "exact_two": "two effects, exact",
        "false_alarms": "false alarms",
        "false_alarms_autocorrelated": "false alarms, autocorrelated noise",
    }
    colours = ("#1b7f5c", "#8fbf5a", "#e08a3c", "#c8402f")
    names = list(methods)
    height = 0.8 / len(keys)
    for number, ((key, label), colour) in enumerate(zip(keys.items(), colours, strict=True)):
        shares = [100.0 * methods[m][key][0] / max(methods[m][key][1], 1) for m in names]
        places = [k + (number - 1.5) * height for k in range(len(names))]
        axes.barh(places, shares, height=height, color=colour, label=label)
    axes.set_yticks(range(len(names)), [METHOD_NAMES.get(m, m) for m in names])
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("share of logs, %")
    axes.set_title("The same logs, other methods", loc="left")
    if names:
        _legend_below(axes, 2)


def _legend_below(axes: Any, columns: int) -> None:
    axes.legend(
        frameon=False, fontsize=8, ncols=columns, loc="upper center", bbox_to_anchor=(0.5, -0.2)
    )
