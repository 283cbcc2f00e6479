"""A request is taken whole or refused in one sentence that names field, value and remedy."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import RequestError
from planner.search.request import PlanRequest

GOOD: dict[str, Any] = {
    "map": "warehouse",
    "vehicle": "minibalance",
    "start": {"x": 1.5, "y": 2},
    "goal": {"x": 8, "y": 9, "yaw": 0.5},
}


def refusal(**changes: Any) -> RequestError:
    with pytest.raises(RequestError) as caught:
        PlanRequest.from_json({**GOOD, **changes})
    return caught.value


def test_what_is_left_out_takes_its_default() -> None:
    request = PlanRequest.from_json(GOOD)
    assert request.start.yaw is None
    assert request.goal.yaw == 0.5
    assert request.via == ()
    assert request.payload.mass == 0
    assert (request.objective, request.alternatives, request.seed) == ("energy", 1, 0)
    assert request.time_budget_s == 2.0


def test_the_default_vehicle_gives_way_to_a_model() -> None:
    without = {key: value for key, value in GOOD.items() if key != "vehicle"}
    assert PlanRequest.from_json(without).vehicle == "minibalance"
    assert PlanRequest.from_json({**without, "model": "m.json"}).vehicle is None


def test_a_request_survives_json() -> None:
    request = PlanRequest.from_json({**GOOD, "via": [{"x": 3, "y": 3}], "iterations": 500})
    assert PlanRequest.from_text(request.model_dump_json()) == request


def test_numpy_numbers_are_numbers() -> None:
    start = {"x": np.float32(0.5), "y": np.int64(2)}
    assert PlanRequest.from_json({**GOOD, "start": start, "seed": np.int64(7)}).start.x == 0.5


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"start": {"x": math.nan, "y": 0}}, "start.x", "finite"),
        ({"goal": {"x": 0, "y": math.inf}}, "goal.y", "finite"),
        ({"goal": {"x": 10**400, "y": 0}}, "goal.x", "finite"),
        ({"goal": {"x": 10**5000, "y": 0}}, "goal.x", "finite"),
        ({"start": {"x": True, "y": 0}}, "start.x", "not a number"),
        ({"start": {"x": "1", "y": 0}}, "start.x", "not a number"),
        ({"start": {"x": 1}}, "start.y", "missing"),
        ({"start": [1, 2]}, "start", "not an object"),
        ({"start": None}, "start", "not an object"),
        ({"via": [{"x": 1, "y": 1}, {"x": 1, "y": None}]}, "via[1].y", "not a number"),
        ({"via": [{"x": 1, "y": 1}] * 51}, "via", "too many"),
        ({"payload": {"mass": -1}}, "payload.mass", "too small"),
        ({"conditions": {"wind": {"x": 3, "up": 1}}}, "conditions.wind.up", "no such field"),
        ({"conditions": {"battery_charge": 1.5}}, "conditions.battery_charge", "too large"),
        ({"objective": "beauty"}, "objective", '"energy", "time" or "length"'),
        ({"alternatives": 0}, "alternatives", "1 to 5"),
        ({"alternatives": 2.0}, "alternatives", "whole"),
        ({"seed": -1}, "seed", "too small"),
        ({"seed": True}, "seed", "whole"),
        ({"time_budget_s": 0}, "time_budget_s", "too small"),
        ({"time_budget_s": 601}, "time_budget_s", "too large"),
        ({"map": ""}, "map", "empty"),
        ({"map": "a\x00b"}, "map", "cannot be printed"),
        ({"map": 3}, "map", "not text"),
        ({"model": "m.json"}, "model", "beside vehicle"),
        ({"timebudget": 3}, "timebudget", "did you mean 'time_budget_s'"),
    ],
)
def test_a_refusal_names_the_field_and_what_would_do(
    changes: dict[str, Any], field: str, words: str
) -> None:
    error = refusal(**changes)
    assert error.field == field
    assert words in str(error)
    assert error.accepted
    assert "\n" not in str(error)


def test_a_misspelt_field_is_named_before_the_one_it_leaves_missing() -> None:
    document = {("strat" if key == "start" else key): value for key, value in GOOD.items()}
    with pytest.raises(RequestError, match=r"strat.*did you mean 'start'"):
        PlanRequest.from_json(document)


TEXT = json.dumps(GOOD)


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


_json = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@given(field=st.sampled_from(sorted(PlanRequest.model_fields)), value=_json)
def test_any_json_in_any_field_is_taken_or_refused_with_that_field(field: str, value: Any) -> None:
    refused_for = ""
    try:
        PlanRequest.from_json({**GOOD, "vehicle": None, field: value})
    except RequestError as error:
        refused_for = error.field
    assert refused_for.split(".")[0].split("[")[0] in {"", field, "request"}


def test_checking_a_request_needs_no_planner() -> None:
    script = (
        "import sys, planner.search.request; print({'numba', 'ompl', 'numpy'} & {*sys.modules})"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "set()"


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
    with pytest.raises(RequestError, match=r"model: is given beside vehicle"):
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
