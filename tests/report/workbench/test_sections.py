"""Sections of a page tell the figures of the result."""

from __future__ import annotations

from planner.report.workbench.sections import taken_away
from tests.report.workbench.reading import rows_of, tree, words


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
    assert taken_away(5.0, 6.0, 3.0) == "The error on unseen runs grows."
    assert taken_away(3.0, 3.0, 3.0) == ""
    assert taken_away(0.0, 0.0, None) == ""


def test_the_evidence_follows_the_verdict(pages: dict[str, str]) -> None:
    headings = [s.findtext("h2") for s in tree(pages["diagnosis"]).iter("section")]
    assert headings[:2] == [None, "The evidence"]
    said = words([*tree(pages["diagnosis"]).iter("section")][1])
    assert "the stretch in which the model at the start errs most" in said
    assert "Line: what air_drag changes. It should go through the dots." in said
    # 41 % of the squared error in a fifth of the rows.
    assert "20 % of the rows" in said
    assert "41 % of the squared error" in said
