"""The page says what the answer says, stands alone, and is a well-formed document."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.report import write_report
from planner.report.drawing import grouped, mean_power, nice_ticks, thinned, tick_words
from planner.search.pictures import (
    GIVEN_BACK,
    coloured_pieces,
    html,
    map_svg,
    power_colour,
    window_of,
)
from planner.search.relief_image import relief_image
from tests.report.synthetic import answer, route, terrain


@pytest.fixture
def page(tmp_path: Path) -> str:
    path = tmp_path / "pages" / "report.html"
    nowhere = answer(status="no_route", reason="a wall", routes=(), baselines={})
    write_report({"one <way>": answer(), "another": nowhere}, path, "A & B")
    return path.read_text(encoding="utf-8")


def test_the_page_holds_all_it_needs(page: str) -> None:
    # Namespaces are names and not addresses that are loaded.
    without_names = re.sub(r'xmlns="[^"]+"|"http://www.w3.org/2000/svg"', "", page)
    assert "http" not in without_names
    assert not re.search(r"<(link|script|img|iframe)[^>]+(src|href)=", page)


def test_text_from_outside_is_text(page: str) -> None:
    for text in ("one &lt;way&gt;", "A &amp; B", "x &lt; y &amp; z", "ramp &lt;1&gt;"):
        assert text in page


def test_numbers_are_those_of_the_answer(page: str) -> None:
    # 20 W for 16 s, and 25 W for the baseline.
    assert "<b>320.0 J</b>" in page
    assert "the shortest route costs 25 % more" in page
    assert re.search(r"climbing.{0,60}</th><td>80.0 J</td><td>25.0 %</td>", page)
    assert "No route: a wall" in page


def test_what_is_known_of_the_energy_is_told(page: str) -> None:
    # 320 J within a tenth, of 1,000 J.
    assert "288.0 J … 352.0 J (95 %)" in page
    assert "comes from electronics (power) 60 %, noise of one drive 40 %." in page
    assert "the chance that it suffices is over 99.99 %" in page


def test_poses_for_the_cursor_are_json(page: str) -> None:
    found = re.findall(r'<script type="application/json" class="poses">(.*?)</script>', page)
    poses = json.loads(found[0])
    assert len({len(column) for column in poses.values()}) == 1
    assert (poses["energy_j"][-1], poses["distance"][0]) == (320.0, 0.0)


def test_drawings_are_well_formed(page: str) -> None:
    drawings = re.findall(r"<svg.*?</svg>", page, re.DOTALL)
    assert len(drawings) >= 5
    for drawing in drawings:
        ElementTree.fromstring(drawing)


def test_a_notebook_card_without_a_route_says_why() -> None:
    assert "a wall &amp; more" in html(answer(status="no_route", reason="a wall & more", routes=()))
    ElementTree.fromstring(f"<div>{html(answer())}</div>")


def test_mean_power_keeps_the_energy() -> None:
    one = route()
    edges, watts = mean_power(one, most=7)
    times = np.diff(np.interp(edges, one.distance_m, one.arrays["t"]))
    for effect, joules in one.breakdown_j.items():
        assert watts[effect] @ times == pytest.approx(joules, rel=1e-9)


def test_mean_power_counts_what_a_turn_on_the_spot_costs() -> None:
    one = route()
    arrays = {name: np.insert(values, 9, values[8]) for name, values in one.arrays.items()}
    # 4 s of turning at 20 W between two poses at one place.
    arrays["t"] = np.concatenate([arrays["t"][:9], arrays["t"][9:] + 4.0])
    shares = {e: np.insert(w, 9, w[8]) for e, w in one.watts_by_effect.items()}
    turning = replace(one, arrays=arrays, watts_by_effect=shares)
    edges, watts = mean_power(turning, most=7)
    last = np.append(np.diff(turning.distance_m) > 0, True)
    times = np.diff(np.interp(edges, turning.distance_m[last], arrays["t"][last]))
    assert times.sum() == pytest.approx(20.0)
    assert sum(float(w @ times) for w in watts.values()) == pytest.approx(400.0)


def test_what_is_grouped_adds_up() -> None:
    values = {"a": np.array([3.0]), "b": np.array([-1.0]), "c": np.array([0.5])}
    parts = grouped(values, ["a"])
    assert parts["other"] == pytest.approx(-0.5)
    assert sum(parts.values()) == pytest.approx(2.5)


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-3.2, 17.0), (0.0, 0.004), (95.0, 96.0)])
def test_ticks_are_round_and_inside(low: float, high: float) -> None:
    ticks = nice_ticks(low, high)
    assert 3 <= len(ticks) <= 11
    assert low - 1e-9 <= min(ticks)
    assert max(ticks) <= high + 1e-9


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (-1.4e-14, 80.0, ["0", "20", "40", "60", "80"]),
        (12041.22, 12041.31, ["12041.225", "12041.250", "12041.275", "12041.300"]),
        (-0.00042, 0.0005, ["-0.00025", "0.00000", "0.00025", "0.00050"]),
        (0.0, 1_250_000.0, ["0", "500000", "1000000"]),
    ],
)
def test_ticks_have_the_digits_of_their_step(low: float, high: float, words: list[str]) -> None:
    assert tick_words(nice_ticks(low, high, count=4)) == words


def test_power_that_is_only_rounding_gives_nothing_back(tmp_path: Path) -> None:
    one = route()
    watts = one.arrays["watts"].copy()
    watts[10:15] = -1.4e-14
    idle = replace(one, arrays={**one.arrays, "watts": watts})
    braking = replace(one, arrays={**one.arrays, "watts": np.where(watts < 0, -3.0, watts)})
    for driven, said in ((idle, False), (braking, True)):
        write_report({"there": answer(routes=(driven,))}, tmp_path / "page.html", "A route")
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert ("gives back" in page) is said
        blue = "#{:02x}{:02x}{:02x}".format(*GIVEN_BACK)
        assert (blue in {colour for colour, _ in coloured_pieces(driven)}) is said


def test_an_effect_that_shows_as_nothing_is_left_out(tmp_path: Path) -> None:
    one = replace(route(), breakdown_j={**route().breakdown_j, "gear_loss": -1e-6})
    write_report({"there": answer(routes=(one,))}, tmp_path / "page.html", "A route")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "-0.0" not in page.partition("class='account'")[2].partition("</table>")[0]


def test_thinning_keeps_both_ends() -> None:
    assert list(thinned(3)) == [0, 1, 2]
    kept = thinned(100_000, most=50)
    assert (kept[0], kept[-1], len(kept)) == (0, 99_999, 50)


def test_coloured_pieces_cover_every_step_once() -> None:
    one = route()
    watts = one.arrays["watts"].copy()
    watts[10:15] = -3.0
    changed = replace(one, arrays={**one.arrays, "watts": watts})
    pieces = list(coloured_pieces(changed))
    steps = [step for _, run in pieces for step in zip(run, run[1:], strict=False)]
    assert steps == [(k, k + 1) for k in range(len(watts) - 1)]
    given_back = "#266edc"
    assert [run for colour, run in pieces if colour == given_back] == [list(range(9, 15))]


def test_more_power_is_darker() -> None:
    brightness = [sum(power_colour(w, 0.0, 10.0)) for w in (0.0, 3.0, 7.0, 10.0)]
    assert brightness == sorted(brightness, reverse=True)
    assert power_colour(99.0, 0.0, 10.0) == power_colour(10.0, 0.0, 10.0)


def test_north_is_up_and_obstacles_are_dark() -> None:
    ground = terrain()
    picture = relief_image(ground, ground.extent, pixels=200)
    assert picture.size == (200, 100)
    # The obstacle is at (18.5, 8.5): right and near the upper edge.
    assert max(picture.getpixel((185, 15))) < 100  # type: ignore[type-var]
    # The hole is at (1.5, 1.5): left and near the lower edge.
    assert picture.getpixel((15, 85)) == (236, 236, 238)


def test_the_window_holds_the_route_and_stays_on_the_map() -> None:
    west, south, east, north = window_of(answer())
    assert west <= 2.0
    assert east >= 18.0
    xmin, ymin, xmax, ymax = terrain().extent
    assert xmin <= west
    assert ymin <= south
    assert east <= xmax
    assert north <= ymax


def test_the_route_lies_where_the_map_says() -> None:
    drawing = ElementTree.fromstring(map_svg(answer(), width=500))
    scale, x0, y1 = (float(drawing.attrib[f"data-{k}"]) for k in ("scale", "x0", "y1"))
    circles = [e for e in drawing.iter() if e.tag.endswith("circle")]
    start = circles[0]
    assert float(start.attrib["cx"]) / scale + x0 == pytest.approx(2.0, abs=0.02)
    assert y1 - float(start.attrib["cy"]) / scale == pytest.approx(5.0, abs=0.02)


def test_a_figure_is_drawn_with_and_without_a_route(tmp_path: Path) -> None:
    answer().plot().savefig(tmp_path / "route.png", dpi=40)
    answer(status="no_route", routes=(), baselines={}).plot().savefig(tmp_path / "no.png", dpi=40)
    assert (tmp_path / "route.png").stat().st_size > 1000
