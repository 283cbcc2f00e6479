"""The workbench's documents for a terminal: one sentence first, then short tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from rich.console import Group, RenderableType
from rich.text import Text

from planner.amounts import estimate, joules, number, share, signed, watts
from planner.report.workbench_wording import (
    RUN_HEADS,
    Document,
    about,
    could_be_missing,
    excess,
    how_far,
    how_it_came_about,
    likelihood,
    model_name,
    run_row,
    untestable,
    what_came_of_it,
)
from service.cli.evidence import evidence
from service.cli.terminal import grid

_MOST_RUNS = 10
"""Runs with the largest errors that are shown."""
_MOST_CANDIDATES = 8
"""Best candidates that are shown."""
# Findings about the format of a log are not shown with a result.
_SILENT = ("format", "not used")
_HINTED = "the log hints at it, "


def comparison(document: Document) -> RenderableType:
    """Output of `joulepath compare`."""
    log, energy = document["log"], document["energy"]
    error = excess(energy)
    off = "" if error is None else f", {share(abs(error))} too {'high' if error > 0 else 'low'}"
    fit = "" if document["r2"] is None else f"R² {number(document['r2'])} "
    measured = (
        f"Mean error {watts(document['mae_w'])}, bias {signed(document['bias_w'])}, "
        f"{fit}over {log['rows']:,} rows in {log['runs']} runs; "
        f"energy measured {joules(energy['measured_j'])}, "
        f"predicted {joules(energy['predicted_j'])}{off}."
    )
    return _group(
        how_far(document),
        measured,
        regimes(document["regimes"]),
        runs(document["runs"]),
        *remarks(log),
    )


def diagnosis(document: Document) -> RenderableType:
    """Output of `joulepath diagnose`: the verdict, its evidence, and what could be missing."""
    sentence = document.get("sentence") or document["verdict"].replace("_", " ")
    first, end, rest = sentence.partition(". ")
    return _apart(
        Text.assemble((first + end, "bold"), rest),
        *evidence(document),
        ranking(document),
        *_next_steps(document),
        Group(*_open_questions(document)),
        Group(*remarks(document.get("log") or {})),
    )


def adoption(document: Document) -> RenderableType:
    """Output of `joulepath adopt`."""
    different = dict.fromkeys(document["warnings"])
    warnings = [Text(f"Warning: {warning}", style="yellow") for warning in different]
    return _group(
        what_came_of_it(document), *warnings, parameters(document["parameters"]), versions(document)
    )


def reversion(document: Document) -> RenderableType:
    """Output of `joulepath revert`."""
    return _group(f"Reverted; this is {model_name(document['model'])}.", versions(document))


def history(document: Document) -> RenderableType:
    """Output of `joulepath history`."""
    entries = document["history"]
    sentence = how_it_came_about(document["model"], entries)
    return _group(sentence, versions(document)) if entries else Text(sentence)


def timings(document: Document) -> RenderableType:
    """Output of `joulepath bench`."""
    rows = [(row["name"], _time(row["seconds"]), row["what"]) for row in document["timings"]]
    return grid(("on this machine", "time", "what"), rows, left=(0, 2))


def regimes(entries: Sequence[Document]) -> RenderableType | None:
    """Where the model fails, worst first as the document has it."""
    if not entries:
        return Text(
            "The residual has no structure that stands out from the noise, over anything that the "
            "log has a column for."
        )
    headings = ("where", "rows", "measured − predicted", "rms", "of the squared error")
    table = grid(headings, title="Where the model fails")
    for entry in entries:
        table.add_row(
            entry["where"],
            f"{entry['rows']:,}",
            signed(entry["bias_w"]),
            watts(entry["rmse_w"]),
            share(entry["share_of_squared_error"]),
        )
    return table


def runs(entries: Sequence[Document]) -> RenderableType | None:
    """Energy run by run; of many runs those with the largest error."""
    if not entries:
        return None
    worst = sorted(entries, key=lambda entry: -abs(excess(entry) or 0.0))[:_MOST_RUNS]
    shown = [entry for entry in entries if entry in worst][:_MOST_RUNS]
    title = "Energy by run"
    if len(entries) > len(shown):
        title += f", the {len(shown)} of {len(entries)} with the largest error"
    return grid(RUN_HEADS, map(run_row, shown), title=title)


def ranking(document: Document) -> RenderableType | None:
    """Effects that could be missing, best first; without those that do not lower the error."""
    shown, left_out = could_be_missing(document)
    selected = document["selected"]
    if not shown:
        said = f"None of {left_out} effects lowers the error on unseen runs."
        return Text(said) if left_out else None
    aliased = any(c["indistinguishable_from"] for c in shown)
    headings = ("effect", "probability", "error with it", "size", *["tied with"] * aliased)
    title = "What could be missing, best first"
    if not selected:
        title = "Effects that lower the error a little; none is named"
    table = grid(headings, left=(0, 3, 4), title=title)
    for candidate in shown[:_MOST_CANDIDATES]:
        fitted = [
            f"{name} {estimate(p['value'], p.get('stderr'), p.get('unit') or '')}"
            for name, p in candidate["parameters"].items()
        ]
        table.add_row(
            candidate["effect"],
            likelihood(candidate, document),
            watts(candidate["heldout_rmse_w"]),
            ", ".join(fitted),
            *[", ".join(candidate["indistinguishable_from"])] * aliased,
            style="bold" if candidate["effect"] in selected else "",
        )
    more = len(shown) - _MOST_CANDIDATES
    rest = [f"{more} less likely ones"] if more > 0 else []
    if left_out:
        rest.append(f"{left_out} that do not lower the error")
    notes = [f"and {', '.join(rest)}"] if rest else []
    if len(selected) > 1:
        notes.append("the error with a named effect is that with all named ones")
    if notes:
        table.caption = "; ".join(notes)
    return table


def parameters(entries: Sequence[Document]) -> RenderableType | None:
    """Fitted parameters with their uncertainty."""
    if not entries:
        return None
    headings = ("effect", "parameter", "value", "note")
    table = grid(headings, left=(0, 1, 3), title="Fitted parameters")
    several = Counter((entry["effect"], entry["name"]) for entry in entries)
    for entry in entries:
        name = entry["name"]
        if several[entry["effect"], name] > 1:
            name = f"{name} {entry['element'] + 1}"
        table.add_row(
            entry["effect"],
            name,
            estimate(entry["value"], entry.get("stderr"), entry.get("unit") or ""),
            entry.get("note") or "",
        )
    return table


def versions(document: Document) -> RenderableType | None:
    """The history of a model, version by version."""
    entries = document["history"]
    if not entries:
        return None
    headings = ("version", "from", "what", "log", "held-out before", "after", "noise", "when")
    table = grid(headings, left=(2, 3, 7), title="History")
    for entry in entries:
        before, after = entry.get("before") or {}, entry.get("after") or {}
        table.add_row(
            str(entry["version"]),
            "" if entry.get("parent") is None else str(entry["parent"]),
            " ".join([entry["action"], ", ".join(entry.get("adopted") or ())]).strip(),
            (entry.get("log") or {}).get("source") or "",
            watts(before.get("heldout_rmse_w")),
            watts(after.get("heldout_rmse_w")),
            watts(entry.get("noise_floor_w")),
            str(entry.get("at") or "")[:16].replace("T", " "),
        )
    return table


def remarks(log: Document) -> Iterator[Text]:
    """What was found in a log, derived from it and taken for granted."""
    for finding in log.get("report", ()):
        if finding["kind"] not in _SILENT:
            yield Text(f"Log: {finding['sentence']}.", style="dim")
    for kind in ("derived", "assumed"):
        if sentences := log.get(kind):
            yield Text(f"{kind.capitalize()}: {'; '.join(sentences)}.", style="dim")


def _next_steps(document: Document) -> Iterator[RenderableType]:
    """What to measure next."""
    if entries := document["experiments"]:
        said = [Text(f"{about(entry)}{entry['run']}") for entry in entries]
        yield Group(Text("What to measure next", style="italic"), *said)


def _open_questions(document: Document) -> Iterator[Text]:
    """What could not be tested, one line for each cause."""
    for cause, (effects, helps) in untestable(document).items():
        alike = f" {next(iter(helps))}" if len(helps) == 1 else ""
        hinted = cause.startswith(_HINTED)
        lead, between = ("Hinted at: ", ", ") if hinted else ("Not testable: ", ": ")
        why = f"{between}{cause.removeprefix(_HINTED)}.{alike}"
        yield Text.assemble((lead, "dim"), ", ".join(effects), (why, "dim"))


def _time(seconds: float) -> str:
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if seconds >= scale:
            return f"{seconds / scale:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def _apart(*parts: RenderableType | None) -> Group:
    """Parts with an empty line between them."""
    shown = [part for part in parts if part is not None and getattr(part, "renderables", True)]
    spaced = [line for part in shown for line in (Text(""), part)]
    return Group(*spaced[1:])


def _group(sentence: str, *parts: RenderableType | str | None) -> Group:
    texts = [Text(part) if isinstance(part, str) else part for part in parts if part is not None]
    return Group(Text(sentence, style="bold"), *texts)
