"""Pages about the workbench's results say what the results say, stand alone, and take any name."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import RequestError
from planner.report import figure_names, fragment, write_telemetry_report
from planner.report.markup import Markup, plain, table
from planner.report.residuals import lacking, look_of
from planner.report.telemetry_sections import taken_away
from planner.telemetry.diagnosis import Errors
from planner.telemetry.wording import how_far, what_came_of_it
from tests.report import synthetic_results as results
from tests.report.synthetic_results import EVIL, RESULTS, RIPPLE_W, Material

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Material:
    return results.material(tmp_path_factory.mktemp("logs"))


@pytest.fixture(scope="module")
def pages(made: Material, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("pages") / "made" / "on demand"
    written = {}
    for name, make in RESULTS.items():
        write_telemetry_report(make(made), folder / f"{name}.html", f"{name} {EVIL}")
        written[name] = (folder / f"{name}.html").read_text(encoding="utf-8")
    return written


def tree(page: str) -> ElementTree.Element:
    return ElementTree.fromstring(page.replace("<!DOCTYPE html>", "", 1))


def words(element: ElementTree.Element) -> str:
    return " ".join("".join(element.itertext()).split())


def rows_of(page: str, heading: str) -> list[list[str]]:
    """Cells of the tables in the section with a heading."""
    found = [s for s in tree(page).iter("section") if s.findtext("h2") == heading]
    assert found, heading
    return [[words(cell) for cell in row] for row in found[0].iter("tr")]


# All pages alike.


@pytest.mark.parametrize("name", RESULTS)
def test_pages_are_strictly_well_formed_whatever_things_are_called(
    pages: dict[str, str], name: str
) -> None:
    root = tree(pages[name])
    assert list(root.iter("script")) == []
    assert "\x07" not in pages[name]
    assert words(root.find("head/title") or root).startswith(name)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", RESULTS)
def test_pages_need_nothing_else(pages: dict[str, str], name: str) -> None:
    assert "http" not in pages[name].replace("http://www.w3.org", "")
    for element in tree(pages[name]).iter():
        assert not {"src", "href", "onclick", "onload"} & set(element.attrib)
        assert element.tag not in ("link", "img", "iframe", "script", "object")


@pytest.mark.parametrize("name", RESULTS)
def test_pictures_are_told_to_those_who_cannot_see_them(pages: dict[str, str], name: str) -> None:
    drawings = list(tree(pages[name]).iter("svg"))
    assert drawings
    for drawing in drawings:
        assert drawing.attrib["role"] == "img"
        assert drawing[0].tag == "title"
        assert drawing.findtext("title")
    ids = [e.attrib["id"] for e in tree(pages[name]).iter() if "id" in e.attrib]
    assert len(ids) == len(set(ids))


@pytest.mark.parametrize("name", RESULTS)
def test_no_number_is_none(pages: dict[str, str], name: str) -> None:
    assert not re.search(r"\b(nan|inf|None)\b", words(tree(pages[name])))
    assert not re.search(r'"[^"]*\b(nan|inf)\b[^"]*"', pages[name])


@pytest.mark.parametrize("name", RESULTS)
def test_a_card_for_notebooks_is_well_formed(made: Material, name: str) -> None:
    result = RESULTS[name](made)
    card = ElementTree.fromstring(fragment(result))
    assert card.attrib["class"] == "joulepath card"
    assert [*card.iter("script")] == []
    assert result._repr_html_() == fragment(result)
    # Its rules are for nothing else in the notebook.
    rules = re.findall(r"(?:^|[}])\s*([^{}@]+)\{", card.findtext("style") or "")
    selectors = [s for rule in rules for s in rule.split(",")]
    assert [s for s in selectors if "joulepath" not in s] == []


def test_text_from_outside_stays_text() -> None:
    assert plain("<b>\x00\ud800</b>") == "&lt;b&gt;\ufffd\ufffd&lt;/b&gt;"
    assert plain(Markup("<b/>")) == "<b/>"
    assert "&lt;i&gt;" in table("<i>", ["<i>"] * 2, [["<i>"] * 2])
    assert "<i>" not in table("<i>", ["<i>"] * 2, [["<i>"] * 2])


# Figures on the page are those of the result.


def test_the_verdict_comes_first(pages: dict[str, str], made: Material) -> None:
    for name, sentence in (
        ("diagnosis", "Something is missing: "),
        ("comparison", how_far(results.comparison(made).to_json())[:30]),
        ("adoption", what_came_of_it(results.adoption(made).to_json())[:30]),
    ):
        first = next(tree(pages[name]).iter("section"))
        lead = next(e for e in first if e.attrib.get("class") == "lead")
        assert words(lead).startswith(sentence)
    assert "Outside the catalogue" in words(next(tree(pages["diagnosis"]).iter("section")))


def test_errors_are_drawn_to_scale_against_the_noise(made: Material) -> None:
    drawing = ElementTree.fromstring(results.diagnosis(made).figure("errors").svg)
    bars = [e for e in drawing.iter(f"{SVG}rect") if "solid" in e.attrib["class"]]
    widths = [float(bar.attrib["width"]) for bar in bars]
    assert widths[1] / widths[0] == pytest.approx(0.678 / 2.345, rel=1e-2)
    noise = next(e for e in drawing.iter(f"{SVG}line"))
    assert float(noise.attrib["x1"]) / widths[0] == pytest.approx(0.4321 / 2.345, rel=1e-2)
    shown = " ".join(drawing.itertext())
    for text in ("2.35 W", "0.68 W", "0.43 W", "with air_drag + unknown_heading"):
        assert text in shown


def test_candidates_with_their_evidence(pages: dict[str, str]) -> None:
    rows = rows_of(pages["diagnosis"], "What could be missing")
    assert rows[0][-1] == "cannot be told from"
    assert rows[1] == [
        "air_drag air", "97 %", "0.31", "26.5", "< 1e-12", "0.68 W",
        "size = 0.1234 ± 0.0056 m²", "vibration",
    ]  # fmt: skip
    assert rows[2][1:6] == ["2.0 %", "0.31", "2.5", "0.012", ""]
    assert len(rows) == 3
    said = "This log cannot tell air_drag from vibration: either explains it as well."
    assert said in words(tree(pages["diagnosis"]))


def test_a_column_that_says_nothing_is_left_out(made: Material, tmp_path: Path) -> None:
    free = replace(results.diagnosis(made), candidates=(results.candidate("air_drag", 0.9),))
    write_telemetry_report(free, tmp_path / "page.html")
    rows = rows_of((tmp_path / "page.html").read_text(), "What could be missing")
    assert rows[0][-1] == "parameters"


def test_probabilities_are_not_told_when_no_candidate_was_chosen(
    made: Material, tmp_path: Path
) -> None:
    alone = replace(results.diagnosis(made), selected=())
    write_telemetry_report(alone, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "probability" not in rows_of(page, "What could be missing")[0]
    assert "none of these explains what is left over" in page
    assert "97 %" not in alone.figure("candidates").svg


def test_regimes_in_words_and_figures(pages: dict[str, str]) -> None:
    rows = rows_of(pages["diagnosis"], "Where the model is wrong")
    assert rows[1][0].startswith("faster than 0.4 m/s </td><script>")
    assert rows[1][1:] == ["321", "+3.10 W ± 0.20 W", "3.40 W", "41 %"]
    assert rows[2][2] == "−1.25 W ± 0.20 W"
    assert "no structure that stands out" in words(tree(pages["complete"]))


def test_parameters_with_their_uncertainty(pages: dict[str, str], made: Material) -> None:
    rows = {row[0]: row for row in rows_of(pages["diagnosis"], "Parameters")}
    drag = next(p for p in made.full.parameters if p.effect == "air_drag")
    row = rows[f"air_drag.{drag.name}"]
    assert row[1:5] == [f"{drag.value:.4g}", f"{drag.stderr:.2g}", "m²", ""]
    load = next(p for p in made.full.parameters if p.name == "power")
    before = next(p for p in made.base.parameters if p.name == "power")
    assert rows["electronics.power"][1:5] == [
        f"{load.value:.4g}", f"{load.stderr:.2g}", "W", f"{before.value:.4g}",
    ]  # fmt: skip


def test_what_cannot_be_told_is_gathered_by_reason(pages: dict[str, str]) -> None:
    rows = rows_of(pages["diagnosis"], "What this log cannot tell")
    assert [row[0] for row in rows[1:]] == ["wear, battery_sag"]
    assert rows[1][2] == "Drive for weeks."


def test_experiments_with_their_settings(pages: dict[str, str]) -> None:
    section = words(tree(pages["diagnosis"]))
    assert "To tell air_drag and vibration apart: Drive against a wind." in section
    rows = rows_of(pages["diagnosis"], "What to drive next")
    assert rows[1] == ["1", "5", "as it is", "0.25", "0", "0", "5", "0", "0", "60"]


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


def test_history_as_a_table_and_a_picture(pages: dict[str, str], made: Material) -> None:
    rows = rows_of(pages["model"], "Version by version")
    assert [row[2] for row in rows[1:]] == ["fit", "adopt air_drag", "back to version 1"]
    assert rows[2][4:] == ["7", "2.00 W", "1.00 W", "0.50 W", "2026-05-04 12:34"]
    drawing = ElementTree.fromstring(results.model(made).figure("history").svg)
    dots = [e for e in drawing.iter(f"{SVG}circle") if "solid" in e.attrib["class"]]
    rings = [e for e in drawing.iter(f"{SVG}circle") if "hollow" in e.attrib["class"]]
    assert (len(dots), len(rings)) == (3, 1)
    noise = next(e for e in drawing.iter(f"{SVG}rect"))
    zero = float(noise.attrib["y"]) + float(noise.attrib["height"])
    # Half a watt of noise lies half as high as one watt of error.
    high = zero - float(dots[1].attrib["cy"])
    assert float(noise.attrib["height"]) == pytest.approx(0.5 * high, abs=0.2)
    # Versions on different logs are not joined: the one line is that from ring to dot.
    lines = [e for e in drawing.iter(f"{SVG}line") if e.attrib["class"].startswith("after")]
    assert len(lines) == 1


def test_a_model_without_history_says_so(made: Material, tmp_path: Path) -> None:
    write_telemetry_report(made.base.model, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "has no history" in words(tree(page))
    assert made.base.model.figures() == ()
    with pytest.raises(RequestError, match="no history"):
        made.base.model.figure("history")


def test_how_much_of_the_error_is_gone() -> None:
    # Squared error above the noise: 5² - 3² = 16 before, 4² - 3² = 7 after.
    assert "56 % is gone" in taken_away(5.0, 4.0, 3.0)
    assert "100 % is gone" in taken_away(5.0, 2.9, 3.0)
    assert taken_away(5.0, 6.0, 3.0) == "The held-out error grows."
    assert taken_away(3.0, 3.0, 3.0) == ""
    assert taken_away(0.0, 0.0, None) == ""


# What is drawn.


def test_what_is_looked_at(made: Material) -> None:
    look = look_of(results.diagnosis(made))
    assert look.after is not None
    assert look.stretch is not None
    assert look.measured - look.before == pytest.approx(look.residual_before[: len(look.before)])
    # The ripple is the largest thing that is missing, and the heading shows it.
    assert next(iter(look.curves)) == "heading"
    curve = look.curves["heading"]
    angles = np.array(curve.before.x, float)
    assert np.corrcoef(np.cos(3 * angles), curve.before.bias)[0, 1] > 0.85
    assert curve.after is not None
    assert np.abs(curve.after.bias).max() < 0.25
    # The stretch is the worst of all that have its length.
    log, rows = made.log, len(look.stretch.time)
    worst = float(((look.stretch.measured - look.stretch.before) ** 2).sum())
    for run in range(len(log.run_names)):
        squares = (log.power - made.base.watts)[log.run == run] ** 2
        assert np.convolve(squares, np.ones(rows), "valid").max() <= worst * (1 + 1e-9)


def test_what_the_formula_is_held_against_is_what_the_robot_hides(made: Material) -> None:
    found = lacking(results.diagnosis(made))
    assert found is not None
    angles = np.array(found.x, float)
    sector = np.sinc(3 * np.pi / 24 / np.pi)  # mean of the ripple over a bin of 15°
    expected = RIPPLE_W * sector * np.cos(3 * angles)
    enough = found.rows > 20
    assert np.abs(found.bias - expected)[enough].max() < 0.35
    assert lacking(results.complete(made)) is None


def test_outside_the_ring_the_robot_needs_more(made: Material) -> None:
    drawing = ElementTree.fromstring(results.comparison(made).figure("heading").svg)
    rings = [e for e in drawing.iter(f"{SVG}circle") if "fill" not in e.attrib]
    zero = next(e for e in rings if e.attrib["class"] == "zero")
    x, y, radius = (float(zero.attrib[k]) for k in ("cx", "cy", "r"))
    # Half a watt more at 0 rad, forward, which is up; half a watt less at 90°, to the left.
    forward, left = [e for e in rings if e.attrib["class"] == "before solid"]
    assert float(forward.attrib["cx"]) == pytest.approx(x, abs=0.2)
    assert y - float(forward.attrib["cy"]) > radius + 5
    assert float(left.attrib["cy"]) == pytest.approx(y, abs=0.2)
    assert 0 < x - float(left.attrib["cx"]) < radius - 5


def test_a_curve_lies_where_its_figures_are(made: Material) -> None:
    drawing = ElementTree.fromstring(results.comparison(made).figure("speed").svg)
    x0, x1, y0, y1 = map(float, drawing.attrib["data-range"].split(","))
    left, top, right, bottom = map(float, drawing.attrib["data-inner"].split(","))
    line = next(e for e in drawing.iter(f"{SVG}polyline"))
    places = [tuple(map(float, p.split(","))) for p in line.attrib["points"].split()]
    for (px, py), (x, y) in zip(places, [(0.1, 0.0), (0.2, 1.0), (0.3, 2.0)], strict=True):
        assert px == pytest.approx(left + (x - x0) / (x1 - x0) * (right - left), abs=0.1)
        assert py == pytest.approx(bottom - (y - y0) / (y1 - y0) * (bottom - top), abs=0.1)


def test_figures_by_name(made: Material, tmp_path: Path) -> None:
    found = results.diagnosis(made)
    names = found.figures()
    assert {"errors", "predicted", "candidates", "shape", "regimes", "heading"} < set(names)
    assert names == figure_names(found)
    picture = found.figure("regimes")
    picture.save(tmp_path / "new" / "regimes.svg")
    root = ElementTree.parse(tmp_path / "new" / "regimes.svg").getroot()
    assert root.tag == f"{SVG}svg"
    assert root.findtext(f"{SVG}style")
    assert picture._repr_svg_() == picture.svg
    with pytest.raises(RequestError, match="candidates") as caught:
        found.figure("horoscope")
    assert caught.value.value == "horoscope"
    with pytest.raises(RequestError):
        fragment("no result")


# Results at the edge.


def edges(made: Material) -> dict[str, Any]:
    one = results.comparison(made)
    silent = {"x": [0.1, 0.2], "bias_w": [0.0, 0.0], "stderr_w": [None, None], "rows": [1, 1]}
    few = made.log.take(np.arange(4))
    return {
        "no curves, regimes, runs": replace(one, curves={}, regimes=(), runs=(), parameters=()),
        "no noise at all": replace(one, noise_floor_w=0.0, curves={"speed": silent}),
        "one row": replace(one, measured=one.measured[:1], predicted=one.predicted[:1]),
        "no power": replace(one, measured=np.zeros(3), predicted=np.zeros(3), r2=None),
        "no candidates": replace(results.diagnosis(made), candidates=()),
        "four rows": replace(results.diagnosis(made), corrected=few),
        "no floor": replace(results.complete(made), baseline=Errors(0.0, 0.0), log={
            "source": "", "sha256": None, "rows": 4, "runs": 1}),
    }  # fmt: skip


def test_little_can_be_shown_too(made: Material, tmp_path: Path) -> None:
    for name, result in edges(made).items():
        write_telemetry_report(result, tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text()
        assert not re.search(r'"[^"]*\b(nan|inf)\b[^"]*"', page), name
        tree(page)
