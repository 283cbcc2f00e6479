"""Evidence of a diagnosis in a terminal: what is shown, in which order, and what is left out."""

from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console

from service.cli.workbench_tables import diagnosis
from tests.service import telemetry_documents as documents


def shown(width: int = 100, **changes: Any) -> str:
    console = Console(width=width, record=True, file=None, force_terminal=False)
    with console.capture() as said:
        console.print(diagnosis(documents.diagnosis(**changes)))
    return said.get()


def lines(text: str, start: str) -> list[str]:
    """Lines from one that begins with ``start`` to the next empty one."""
    every = [line.rstrip() for line in text.splitlines()]
    first = next(k for k, line in enumerate(every) if line.startswith(start))
    last = next((k for k in range(first, len(every)) if not every[k]), len(every))
    return every[first:last]


def test_the_verdict_comes_before_the_evidence_and_that_before_the_ranking() -> None:
    said = shown()
    order = [
        "The model lacks air_drag",
        "Error on runs that the fit has not seen",
        "Where the model errs most",
        "Residual (measured − predicted) over speed",
        "Where the squared error is",
        "What could be missing",
        "What to measure next",
        "Not testable",
    ]
    places = [said.index(words) for words in order]
    assert places == sorted(places)


def test_bars_are_as_long_as_the_errors() -> None:
    rows = lines(shown(), "Error on runs")[1:]
    before, after, noise = (row.count("█") for row in rows)
    assert before == 40
    assert after == round(40 * 0.52 / 2.1)
    assert noise == round(40 * 0.5 / 2.1)


def test_what_is_claimed_lies_on_what_was_measured() -> None:
    plot = lines(shown(), "Where the model errs most: b, 0 to 6 s")[2:]
    # Measured and claimed: first low, then high. The model as it is stays low.
    assert plot[0] == "     20 W │      ⊕⊕⊕⊕⊕⊕"
    assert plot[-1] == "     10 W │⊕⊕⊕⊕⊕⊕······"
    curve = lines(shown(), "Residual (measured")
    assert curve[2].split() == ["0.2", "3,100", "+0.000", "±", "0.10", "+0.000", "⊕"]
    assert curve[3].split()[:4] == ["0.8", "900", "+4.00", "+4.00"]
    assert curve[3].endswith("⊕")
    assert "│" in curve[3]


def test_a_claim_beside_the_measurement_is_seen() -> None:
    pictures = documents.PICTURES
    missed = {**pictures["curves"][0], "fitted_w": [0.0, 2.0]}
    row = lines(shown(pictures={**pictures, "curves": [missed]}), "Residual (measured")[3]
    assert "⊕" not in row
    assert row.index(" + ") < row.rindex("o")


def test_where_nothing_is_missing_there_is_no_curve() -> None:
    said = shown(verdict="complete", selected=[], candidates=[])
    assert "Where the model errs most" in said
    assert "Residual" not in said


def test_shares_of_rows_and_of_the_error() -> None:
    rows = lines(shown(), "Where the squared error is")[2:]
    assert rows[0].split("  ")[0] == "faster than 0.6 m/s"
    assert rows[0].split()[-6:] == ["22", "%", "41", "%", "+3.10", "W"]
    assert rows[1].startswith("everywhere else")


def test_candidates_that_make_things_worse_are_counted_and_not_listed() -> None:
    worse = documents.candidate("viscous_drag", 0.02, heldout_rmse_w=2.3)
    said = shown(candidates=[documents.candidate("air_drag", 0.97), worse], experiments=[])
    assert "viscous_drag" not in said
    assert "1 that do not lower the error" in said


def test_a_named_effect_stands_first_and_no_other_one_looks_certain() -> None:
    other = documents.candidate("vibration", 0.98, heldout_rmse_w=1.9)
    named = documents.candidate("air_drag", None)
    table = lines(shown(candidates=[other, named]), "What could be missing")
    rows = [row for row in table if row.startswith("│")]
    assert rows[0].startswith("│ air_drag")
    assert "not known" in rows[0]
    assert "not confirmed" in rows[1]
    assert "98 %" not in rows[1]


def test_a_tied_effect_is_called_tied() -> None:
    named = documents.candidate("air_drag", 0.97, indistinguishable_from=["vibration"])
    other = documents.candidate("vibration", 0.03, heldout_rmse_w=0.53)
    assert "│ vibration │        tied │" in shown(candidates=[named, other])


def test_what_cannot_be_tested_is_one_line_for_each_cause() -> None:
    said = shown(width=200)
    untested = [line for line in said.splitlines() if line.startswith("Not testable")]
    assert len(untested) == 2
    assert "wear (up to 0.31 W), stiction (up to 0.12 W): it would go unnoticed." in untested[1]


@pytest.mark.parametrize("width", [60, 80, 140])
def test_the_plot_fits_a_narrow_terminal(width: int) -> None:
    assert max(map(len, shown(width).splitlines())) <= width


def test_an_answer_without_pictures_is_shown() -> None:
    said = shown(pictures=None)
    assert "Where the model errs most" not in said
    assert "What could be missing" in said


def test_beside_a_wrong_sensor_candidates_are_held_against_the_corrected_log() -> None:
    fault = {"kind": "slope_offset", "value": 0.03, "stderr": 0.001, "unit": "rad", "sentence": ""}
    # Less than the error as measured, 2.1 W, and more than that of the corrected log, 0.52 W.
    other = documents.candidate("vibration", 0.01, heldout_rmse_w=0.9)
    changes = {"verdict": "sensor_error", "sensor": [fault], "selected": []}
    assert "vibration" not in shown(**changes, candidates=[other])
    assert "with slope_offset corrected" in shown(**changes)
