"""Sections of a page tell the figures of the result."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from planner.report import write_report
from planner.report.workbench.sections import taken_away
from tests.report.workbench.reading import rows_of, tree, words
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import Material


def test_candidates_with_their_evidence(pages: dict[str, str]) -> None:
    rows = rows_of(pages["diagnosis"], "What could be missing")
    assert rows[0][-1] == "aliased with"
    assert rows[1] == [
        "air_drag air", "97 %", "0.31", "26.5", "< 1e-12", "0.68 W",
        "size = 0.1234 ± 0.0056 m²", "vibration",
    ]  # fmt: skip
    assert rows[2][1:6] == ["2.0 %", "0.31", "2.5", "0.012", ""]
    assert len(rows) == 3
    said = (
        "air_drag is aliased with vibration in this log: each explains the residual equally well."
    )
    assert said in words(tree(pages["diagnosis"]))


def test_a_column_that_says_nothing_is_left_out(made: Material, tmp_path: Path) -> None:
    free = replace(results.diagnosis(made), candidates=(results.candidate("air_drag", 0.9),))
    write_report(free, tmp_path / "page.html")
    rows = rows_of((tmp_path / "page.html").read_text(), "What could be missing")
    assert rows[0][-1] == "parameters"


def test_probabilities_are_not_told_when_no_candidate_was_chosen(
    made: Material, tmp_path: Path
) -> None:
    alone = replace(results.diagnosis(made), selected=())
    write_report(alone, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "probability" not in rows_of(page, "What could be missing")[0]
    assert "none of these explains the residual" in page
    assert "97 %" not in alone.figure("candidates").svg


def test_regimes_in_words_and_figures(pages: dict[str, str]) -> None:
    rows = rows_of(pages["diagnosis"], "Where the model is wrong")
    assert rows[1][0].startswith("faster than 0.4 m/s </td><script>")
    assert rows[1][1:] == ["321", "+3.10 W ± 0.20 W", "3.40 W", "41 %"]
    assert rows[2][2] == "−1.25 W ± 0.20 W"
    assert "no structure that stands out" in words(tree(pages["complete"]))


def test_what_cannot_be_told_is_gathered_by_reason(pages: dict[str, str]) -> None:
    rows = rows_of(pages["diagnosis"], "What this log cannot identify")
    assert [row[1] for row in rows[1:]] == ["wear, battery_sag"]
    assert rows[1][2] == "Drive for weeks."


def test_experiments_with_their_settings(pages: dict[str, str]) -> None:
    section = words(tree(pages["diagnosis"]))
    assert "To tell air_drag and vibration apart: Drive against a wind." in section
    rows = rows_of(pages["diagnosis"], "What to measure next")
    assert rows[1] == ["1", "0.25", "0", "0", "0.625", "8"]
    assert rows[2] == ["2", "-0.25", "0", "0", "0.625", "8"]
    assert "run 1: load 5 kg, motors as they are" in section
    assert "falls by a factor of 4 in the simulation" in section
    assert "free area: 3.2 m by 1.1 m" in section


def test_sensors_and_the_log(pages: dict[str, str]) -> None:
    assert rows_of(pages["diagnosis"], "Sensors")[1][:2] == ["slope offset", "0.034 ± 0.002 rad"]
    said = words(tree(pages["diagnosis"]))
    assert "123,456 rows in 8 runs, SHA-256 5eed5eed" in said
    for text in ("3 gaps of", "ax: d(vx)/dt - wz·vy", "no payload: taken as 0 kg"):
        assert text in said


def test_energy_by_run(pages: dict[str, str]) -> None:
    rows = rows_of(pages["comparison"], "Energy by run")
    assert len(rows) == 31
    assert rows[1][2:] == ["1,000 J", "970.0 J", "−3.0 %", "1.00 W", "+0.000 W"]
    said = words(tree(pages["comparison"]))
    assert "Energy: measured 50.00 kJ, predicted 48.50 kJ, 3.0 % too low" in said
    assert "Mean error 1.75 W, bias +0.50 W, R² 0.9321" in said


def test_how_much_of_the_error_is_gone() -> None:
    # Squared error above the noise: 5² - 3² = 16 before, 4² - 3² = 7 after.
    assert "56 % is gone" in taken_away(5.0, 4.0, 3.0)
    assert "100 % is gone" in taken_away(5.0, 2.9, 3.0)
    assert taken_away(5.0, 6.0, 3.0) == "The held-out error grows."
    assert taken_away(3.0, 3.0, 3.0) == ""
    assert taken_away(0.0, 0.0, None) == ""
