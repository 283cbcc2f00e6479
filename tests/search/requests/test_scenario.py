"""A request is read from text, file or call, or refused in one sentence that can be printed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from planner.errors import RequestError
from planner.search.requests.questions import PlanRequest
from tests.search.requests.good import GOOD, refused

TEXT = json.dumps(GOOD)


def test_the_default_vehicle_gives_way_to_a_model() -> None:
    without = {key: value for key, value in GOOD.items() if key != "vehicle"}
    assert PlanRequest.from_json(without).vehicle == "minibalance"
    assert PlanRequest.from_json({**without, "model": "m.json"}).vehicle is None


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"payload": {"mass": -1}}, "payload.mass", "too small"),
        ({"conditions": {"wind": {"x": 3, "up": 1}}}, "conditions.wind.up", "no such field"),
        ({"conditions": {"battery_charge": 1.5}}, "conditions.battery_charge", "too large"),
        ({"map": ""}, "map", "empty"),
        ({"map": "a\x00b"}, "map", "cannot be printed"),
        ({"map": 3}, "map", "not text"),
        ({"model": "m.json"}, "model", "together with vehicle"),
    ],
)
def test_a_refusal_names_the_field_and_what_would_do(
    changes: dict[str, Any], field: str, words: str
) -> None:
    refused(changes, field, words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not JSON"),
        ("{", "not JSON"),
        ("[]", "not a JSON object"),
        ("null", "not a JSON object"),
        (TEXT.replace("1.5", "NaN"), "start.x: is not a finite number"),
        (TEXT.replace("1.5", "-Infinity"), "start.x: is not a finite number"),
        (TEXT.replace("1.5", "1e400"), "start.x: is not a finite number"),
        (TEXT.replace("1.5", "9" * 5000), "too many digits"),
        (TEXT[:-1] + ', "seed": 1, "seed": 2}', "seed: is given twice"),
        (TEXT.replace("warehouse", "\\ud800"), "map: is not valid text"),
        ('{"\\ud800": 1}', "not valid text"),
        ("[" * 100_000, "nested too deeply"),
        ('{"map":' * 100_000, "nested too deeply"),
        (b"\xff\xfe", "not UTF-8"),
    ],
)
def test_hostile_text_is_refused_in_a_printable_sentence(text: str | bytes, words: str) -> None:
    with pytest.raises(RequestError, match=words) as caught:
        PlanRequest.from_text(text)
    str(caught.value).encode()
    assert len(str(caught.value)) < 600


def written(folder: Path, document: Any) -> Path:
    path = folder / "request.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


@pytest.mark.parametrize("kind", [str, Path])
def test_a_function_takes_the_path_of_a_request(tmp_path: Path, kind: Any) -> None:
    path = kind(written(tmp_path, GOOD))
    assert PlanRequest.from_call(path, {}) == PlanRequest.from_json(GOOD)
    assert PlanRequest.from_call(path, {"seed": 3}).seed == 3


def test_keywords_lie_over_a_request_however_it_is_given(tmp_path: Path) -> None:
    given = (GOOD, written(tmp_path, GOOD), PlanRequest.from_json(GOOD))
    for request in given:
        laid = PlanRequest.from_call(request, {"model": "m.json", "goal": {"x": 3, "y": 4}})
        # A model replaces the vehicle.
        assert (laid.vehicle, laid.model) == (None, "m.json")
        assert laid.goal.model_dump() == {"x": 3.0, "y": 4.0, "yaw": None}
        assert laid.start == PlanRequest.from_json(GOOD).start
    with pytest.raises(RequestError, match=r"model: is given together with vehicle"):
        PlanRequest.from_call({**GOOD, "model": "m.json"}, {})


@pytest.mark.parametrize("name", ["nothing.json", ".", "x" * 300, "a\0b", "\ud800.json"])
def test_a_path_that_holds_no_request_is_one_sentence(tmp_path: Path, name: str) -> None:
    with pytest.raises(RequestError, match=r"cannot be read: .*; accepted: the path") as caught:
        PlanRequest.from_call(str(tmp_path / name), {})
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("request_", [[], 3, 0, "", b"{}", object])
def test_what_is_no_request_is_one_sentence(request_: Any) -> None:
    with pytest.raises(RequestError, match="; accepted: "):
        PlanRequest.from_call(request_, {"map": "warehouse"})


def test_a_map_in_place_of_a_request_says_where_maps_go(tmp_path: Path) -> None:
    file = tmp_path / "survey.asc"
    file.write_text("ncols 2\nnrows 2\n")
    with pytest.raises(RequestError, match=r"survey\.asc: is not JSON.*after --map"):
        PlanRequest.from_file(file)
