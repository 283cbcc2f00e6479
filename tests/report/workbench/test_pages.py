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
from planner.report import card, figure_names, write_report
from planner.report.workbench_wording import how_far, what_came_of_it
from planner.telemetry.diagnosis import Errors
from tests.report.workbench.reading import SVG, tree, words
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import RESULTS, Material

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
    shown = ElementTree.fromstring(card(result))
    assert shown.attrib["class"] == "joulepath card"
    assert [*shown.iter("script")] == []
    assert result._repr_html_() == card(result)
    # Its rules are for nothing else in the notebook.
    rules = re.findall(r"(?:^|[}])\s*([^{}@]+)\{", shown.findtext("style") or "")
    selectors = [s for rule in rules for s in rule.split(",")]
    assert [s for s in selectors if "joulepath" not in s] == []


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
        card("no result")


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
        write_report(result, tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text()
        assert not re.search(r'"[^"]*\b(nan|inf)\b[^"]*"', page), name
        tree(page)
