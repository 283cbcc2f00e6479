"""What must hold, and whether it does: one line for every check of the benchmark of naming.

    checks(rows, baselines, long_logs, measured) -> [{"check", "bar", "found", "holds"}, ...]

``holds`` is None where a check was not made, with the reason in ``found``.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tests.hidden_effects.scoring import confidently_wrong
from tests.hidden_effects.tables import section_of

Row = dict[str, Any]
Check = dict[str, Any]

METHOD_NAMES = {
    "pysindy": "PySINDy (STLSQ) on the residual",
    "lasso": "LASSO on the residual",
    "lasso_projected": "LASSO after projection",
    "bic": "BIC with refit",
}


def checks(
    rows: Sequence[Row],
    baselines: Sequence[Row] = (),
    long_logs: Sequence[Mapping[str, Any]] = (),
    measured: Mapping[str, Mapping[str, Any] | None] | None = None,
) -> list[Check]:
    """All checks.

    Args:
        rows: of runner.run, the logs that there are.
        baselines: of runner.run_baselines.
        long_logs: of tests.benchmarks.long_logs.measure.
        measured: "robotino", "contact plain", "contact payload" → real_data's answer or None.
    """
    found = [*_naming(rows), *_adopting(rows)]
    for entry in long_logs:
        said = entry.get("error") or f"{entry['seconds']} s, {entry['peak_mib']:.0f} MiB"
        name = f"{entry['rows']:,} rows, time and peak memory"
        found.append(_check(name, entry.get("bar", ""), said, entry["holds"]))
    found += [_ahead(method, rows, baselines) for method in METHOD_NAMES if baselines]
    found += [_measured(name, entry) for name, entry in (measured or {}).items()]
    return found


def _check(check: str, bar: str, found: str, holds: bool | None) -> Check:
    return {"check": check, "bar": bar, "found": found, "holds": holds}


def _of(rows: Iterable[Row], *sections: str) -> list[Row]:
    return [row for row in rows if section_of(row) in sections]


def _share(check: str, rows: list[Row], least: float, *, never_wrong: bool = False) -> Check:
    right = sum(row["right"] for row in rows)
    wrong = sum(confidently_wrong(row["outcome"]) for row in rows)
    bar = f"≥ {least:.0%}" + ("; confidently wrong 0" if never_wrong else "")
    if not rows:
        return _check(check, bar, "not run", None)
    said = f"{right} of {len(rows)} ({right / len(rows):.1%}), confidently wrong {wrong}"
    return _check(check, bar, said, right >= least * len(rows) and not (never_wrong and wrong))


def _naming(rows: Sequence[Row]) -> list[Check]:
    twins = _of(rows, "one, twins", "one, hardly visible")
    outcomes = Counter(row["outcome"] for row in twins)
    listed = ", ".join(f"{count} {name}" for name, count in outcomes.most_common())
    wrong = sum(confidently_wrong(row["outcome"]) for row in twins)
    return [
        _share("one hidden effect", _of(rows, "one"), 0.98, never_wrong=True),
        _share("nothing hidden", _of(rows, "none"), 0.98),
        _share("nothing hidden, autocorrelated noise", _of(rows, "none_ar"), 0.95),
        _check(
            "twins and effects that hardly show",
            "no confident name",
            f"{len(twins)} logs: {listed}" if twins else "not run",
            wrong == 0 if twins else None,
        ),
        _share("two hidden effects, exactly both", _of(rows, "two"), 0.95),
        _share("outside the catalogue, right quantity", _of(rows, "outside"), 0.95),
        _share("tied designs", _of(rows, "tied"), 0.92, never_wrong=True),
        _share("hard noise and wrong sensors", _of(rows, "hard"), 0.90),
    ]


def excess_removed(row: Row) -> float:
    """Share of the held-out error above the oracle's that adopting takes away."""
    held = row["heldout"]
    return float((held["before_w"] - held["after_w"]) / (held["before_w"] - held["oracle_w"]))


def over_oracle(row: Row) -> float:
    """Held-out RMSE after adopting over the oracle's."""
    return float(row["heldout"]["after_w"] / row["heldout"]["oracle_w"])


def _adopting(rows: Sequence[Row]) -> list[Check]:
    adopted = [row for row in rows if row.get("heldout") and row["visible"]]
    outside = [row for row in adopted if row["outside"]]
    inside = [row for row in adopted if not row["outside"] and not row["twin"]]
    found = []
    bar = "median ≤ 1.02; outside the catalogue ≤ 1.05"
    name = "held-out RMSE after adopting, over the oracle's"
    if inside and outside:
        a, b = (statistics.median(over_oracle(row) for row in part) for part in (inside, outside))
        found.append(_check(name, bar, f"{a:.3f}; {b:.3f}", a <= 1.02 and b <= 1.05))
    if outside:
        shares = [excess_removed(row) for row in outside]
        enough = sum(share >= 0.8 for share in shares)
        said = f"median {statistics.median(shares):.0%}; {enough} of {len(shares)} logs ≥ 80 %"
        found.append(
            _check(
                "outside the catalogue: excess error that the formula takes away",
                "≥ 80 %",
                said,
                statistics.median(shares) >= 0.8,
            )
        )
    failed = sum("following_failed" in row for row in rows)
    if failed:
        found.append(_check("adopting and driving again", "no failure", f"{failed} failed", False))
    found += _coverage(inside)
    again = [row["again"] for row in rows if row.get("again")]
    if again:
        broken = sum(entry["broken"] for entry in again)
        said = f"{broken} of {len(again)} ties"
        found.append(
            _check("the recommended run breaks the tie", "≥ 90 %", said, broken >= 0.9 * len(again))
        )
    return found


def _coverage(rows: Sequence[Row]) -> list[Check]:
    # At a bound an interval is one-sided and says something else.
    kept = [e for row in rows for e in row.get("intervals", ()) if not e["at_bound"]]
    if not kept:
        return []
    shares = {
        of: sum(abs(e["value"] - e[of]) <= 1.96 * e["stderr"] for e in kept) / len(kept)
        for of in ("truth", "noiseless")
    }
    said = (
        f"{shares['truth']:.1%} of {len(kept)} hold the robot's strength, "
        f"{shares['noiseless']:.1%} what the fit finds without noise"
    )
    holds = 0.90 <= shares["truth"] <= 0.98
    return [_check("95 % intervals of the fitted parameters", "90 to 98 %", said, holds)]


def method_figures(rows: Sequence[Row], baselines: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Method → counts on the logs that all methods saw: exact names, false alarms, wrong names."""
    own = {row["case"]: row for row in rows}
    seen = [row for row in baselines if row["case"] in own]
    figures: dict[str, dict[str, Any]] = {}

    def count(name: str, outcomes: Mapping[str, str]) -> None:
        sections = {case: section_of(own[case]) for case in outcomes}

        def share(section: str, *wanted: str) -> list[int]:
            mine = [outcomes[case] for case in outcomes if sections[case] == section]
            return [sum(o in wanted for o in mine), len(mine)]

        figures[name] = {
            "exact_one": share("one", "exact"),
            "exact_two": share("two", "exact"),
            "false_alarms": share("none", "false_alarm", "wrong_sensor"),
            "false_alarms_autocorrelated": share("none_ar", "false_alarm", "wrong_sensor"),
            "wrong_on_twins": share("one, twins", "wrong"),
        }

    count("joulepath", {row["case"]: own[row["case"]]["outcome"] for row in seen})
    for method in METHOD_NAMES:
        outcomes = {
            row["case"]: row["methods"][method]["outcome"]
            for row in seen
            if "outcome" in row["methods"].get(method, {})
        }
        if outcomes:
            count(method, outcomes)
    return figures


def _ahead(method: str, rows: Sequence[Row], baselines: Sequence[Row]) -> Check:
    name, bar = f"against {METHOD_NAMES[method]}", "ahead in exact names and false alarms"
    figures = method_figures(rows, baselines)
    if method not in figures:
        reasons = {row["methods"].get(method, {}).get("skipped") for row in baselines}
        return _check(name, bar, "; ".join(sorted(filter(None, reasons))) or "not run", None)
    theirs, ours = figures[method], figures["joulepath"]

    def total(entry: Mapping[str, Any], *keys: str) -> int:
        return sum(entry[key][0] for key in keys)

    named, alarms = ("exact_one", "exact_two"), ("false_alarms", "false_alarms_autocorrelated")
    logs = [sum(theirs[key][1] for key in keys) for keys in (named, alarms)]
    said = (
        f"exact {total(theirs, *named)} against {total(ours, *named)} of {logs[0]}, "
        f"false alarms {total(theirs, *alarms)} against {total(ours, *alarms)} of {logs[1]}"
    )
    ahead = total(ours, *named) > total(theirs, *named)
    ahead &= total(ours, *alarms) <= total(theirs, *alarms)
    return _check(name, bar, said, ahead)


def _measured(name: str, entry: Mapping[str, Any] | None) -> Check:
    if name == "robotino":
        bar = "wheel_imbalance named; RMSE by run 0.7, headings 0.8, speed 1.1 W"
    else:
        bar = "every effect named lowers the held-out error"
    if entry is None:
        return _check(name, bar, "the data are not there", None)
    if "error" in entry:
        return _check(name, bar, entry["error"], False)
    names = " and ".join(entry["selected"]) or "nothing"
    if name == "robotino":
        parts = [f"{k} {s['adopted_w']:.2f}" for k, s in entry["splits"].items()]
        said = f"{entry['verdict']}, {names}; {', '.join(parts)} W"
    else:
        said = (
            f"{entry['verdict']}, {names}; {entry['base_w']:.2f} → {entry['adopted_w']:.2f} W, "
            f"noise {entry['noise_floor_w']:.2f} W"
        )
    return _check(name, bar, said, entry["holds"])
