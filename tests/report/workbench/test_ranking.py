"""Candidates on a page: what is shown of them does not contradict the verdict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from planner.report import write_report
from planner.report.workbench.ranking import chances, shown_candidates
from tests.report.workbench.reading import rows_of, tree, words
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import Material

HEADING = "What could be missing"


def test_candidates_with_their_evidence(pages: dict[str, str]) -> None:
    rows = rows_of(pages["diagnosis"], HEADING)
    assert rows[0] == ["effect", "probability", "error with it", "parameters", "tied with"]
    assert rows[1] == ["air_drag air", "97 %", "0.68 W", "size = 0.1234 ± 0.0056 m²", "vibration"]
    assert rows[2][:3] == ["vibration shaking", "tied", ""]
    # The statistics are folded below.
    assert rows[3:5] == [
        ["effect", "size / noise", "z", "p"],
        ["air_drag air", "0.31", "26.5", "< 1e-12"],
    ]
    said = "This log cannot tell air_drag from vibration: each explains"
    assert said in words(tree(pages["diagnosis"]))


def written(tmp_path: Path, made: Material, **changes: Any) -> str:
    write_report(replace(results.diagnosis(made), **changes), tmp_path / "page.html")
    return (tmp_path / "page.html").read_text()


def test_a_column_that_says_nothing_is_left_out(made: Material, tmp_path: Path) -> None:
    page = written(tmp_path, made, candidates=(results.candidate("air_drag", 0.9),))
    assert rows_of(page, HEADING)[0][-1] == "parameters"


def test_probabilities_are_not_told_when_no_candidate_was_chosen(
    made: Material, tmp_path: Path
) -> None:
    page = written(tmp_path, made, selected=(), sensors=())
    assert "probability" not in rows_of(page, "Effects that were tried")[0]
    assert "none of these explains the residual" in page
    alone = replace(results.diagnosis(made), selected=(), sensors=())
    assert "97 %" not in alone.figure("candidates").svg


def test_candidates_that_make_things_worse_are_counted(made: Material, tmp_path: Path) -> None:
    worse = results.candidate("stiction", 0.3, heldout_rmse_w=results.BEFORE.heldout_rmse_w + 0.1)
    best = results.candidate("air_drag", 0.97, heldout_rmse_w=0.678)
    page = written(tmp_path, made, candidates=(worse, best))
    assert "stiction" not in " ".join(row[0] for row in rows_of(page, HEADING))
    assert "does not fall: 1." in page


def test_what_is_named_stands_first_and_alone_looks_certain(made: Material) -> None:
    sure = results.candidate("stiction", 0.99, heldout_rmse_w=2.0)
    named = results.candidate("air_drag", 0.6, heldout_rmse_w=0.678)
    found = replace(results.diagnosis(made), candidates=(sure, named))
    shown, _ = shown_candidates(found)
    assert [*shown] == ["air_drag", "stiction"]
    assert chances(found) == {"air_drag": "60 %", "stiction": "not confirmed"}
