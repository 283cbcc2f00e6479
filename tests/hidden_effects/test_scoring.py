"""What an answer is worth: a wrong name is never excused, an honest tie never punished."""

import pytest

from tests.hidden_effects.cases import EFFECTS, KINDS, OUTSIDE, Case, cases
from tests.hidden_effects.scoring import confidently_wrong, score

DRAG = Case("one", "air_drag", 0, {"air_drag": {"size": 0.05}})
PAIR = Case("two", "air_drag+wear", 0, {"air_drag": {"size": 0.05}, "wear": {"size": 0.05}})
NOTHING = Case("none", "nothing", 0)
BUMP = Case("outside", "resonance", 0, {"resonance": {"size": 0.05}}, "resonance")
TILT = Case("hard", "slope_offset", 0, sensor="slope_offset")


def answer(*selected, verdict="", aliases=None, hidden=(), quantities=(), sensors=()):
    """A diagnosis as JSON."""
    aliases = aliases or {}
    listed = dict.fromkeys([*selected, *aliases])
    return {
        "verdict": verdict or ("missing_effect" if selected else "complete"),
        "selected": list(selected),
        "candidates": [
            {"effect": slug, "indistinguishable_from": aliases.get(slug, [])} for slug in listed
        ],
        "not_testable": [{"effect": slug, "why": "", "what_would_help": ""} for slug in hidden],
        "outside_catalogue": {"quantities": list(quantities)} if quantities else None,
        "sensor": [{"kind": kind} for kind in sensors] or None,
    }


@pytest.mark.parametrize(
    ("case", "said", "outcome"),
    [
        (DRAG, answer("air_drag"), "exact"),
        (DRAG, answer("wear"), "wrong"),
        (DRAG, answer("air_drag", "wear"), "wrong"),
        (DRAG, answer("wear", aliases={"wear": ["air_drag"]}), "tied"),
        (DRAG, answer("wear", aliases={"wear": ["sinkage"]}), "wrong"),
        (DRAG, answer(verdict="not_identifiable", aliases={"wear": ["air_drag"]}), "tied"),
        (DRAG, answer(), "missed"),
        (DRAG, answer(hidden=["air_drag"]), "not_testable"),
        (DRAG, answer(verdict="outside_catalogue", quantities=["speed"]), "wrong_outside"),
        (DRAG, answer("air_drag", verdict="sensor_error", sensors=["speed_scale"]), "wrong_sensor"),
        (PAIR, answer("wear", "air_drag"), "exact"),
        (PAIR, answer("wear"), "part"),
        (PAIR, answer("wear", "sinkage"), "wrong"),
        (PAIR, answer("wear", "sinkage", aliases={"sinkage": ["air_drag"]}), "tied"),
        (NOTHING, answer(), "complete"),
        (NOTHING, answer("wear"), "false_alarm"),
        (NOTHING, answer("wear", aliases={"wear": ["sinkage"]}), "false_alarm"),
        (NOTHING, answer(verdict="not_identifiable"), "false_alarm"),
        (NOTHING, answer(verdict="outside_catalogue", quantities=["speed"]), "false_alarm"),
        (NOTHING, answer(verdict="sensor_error", sensors=["speed_scale"]), "wrong_sensor"),
        (BUMP, answer(verdict="outside_catalogue", quantities=["speed"]), "right_outside"),
        (BUMP, answer(verdict="outside_catalogue", quantities=["heading"]), "wrong_outside"),
        (BUMP, answer(verdict="outside_catalogue", quantities=["speed", "load"]), "wrong_outside"),
        (BUMP, answer("wear", verdict="outside_catalogue", quantities=["speed"]), "wrong"),
        (BUMP, answer("air_drag"), "wrong"),
        (BUMP, answer(), "missed"),
        (TILT, answer(verdict="sensor_error", sensors=["slope_offset"]), "right_sensor"),
        (TILT, answer(verdict="sensor_error", sensors=["power_scale"]), "wrong_sensor"),
        (TILT, answer("gear_asymmetry"), "wrong"),
        (TILT, answer(), "missed"),
    ],
)
def test_answers_are_judged_by_what_a_user_would_do_with_them(case, said, outcome):
    assert score(case, said) == outcome


def test_what_makes_a_user_adopt_or_look_for_the_wrong_thing_is_confidently_wrong():
    assert confidently_wrong("wrong")
    assert confidently_wrong("false_alarm")
    assert not confidently_wrong("tied")
    assert not confidently_wrong("missed")


def test_the_whole_table_is_as_large_as_it_says():
    whole = cases(KINDS, 5)
    count = {kind: sum(case.kind == kind for case in whole) for kind in KINDS}
    assert count["one"] == 5 * len(EFFECTS)
    assert count["none"] == count["none_ar"] == 200
    assert count["two"] >= 28
    assert count["outside"] == 5 * len(OUTSIDE)
    assert count["tied"] >= 100
    assert len({case.name for case in whole}) == len(whole)


def test_a_shorter_table_holds_the_same_cases():
    names = {case.name: case for case in cases(KINDS, 5)}
    for case in cases(["one", "none", "outside", "hard"], 2):
        assert names[case.name] == case
