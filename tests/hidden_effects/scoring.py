"""What a diagnosis is worth when the truth is known.

    score(case, diagnosis_json) -> "exact", "tied", ...

    exact           selected is the truth, member by member, and nothing else
    tied            every member selected is true, or has a true one among those that it says it
                    cannot be told from, and every true one is met so; or nothing is selected and
                    the best candidates hold the truth in their tie
    part            some of several true effects, and nothing wrong
    wrong           confidently wrong: a member that is not true, without the truth in its tie
    false_alarm     an effect or a shape where nothing is hidden
    missed          nothing named although something is hidden
    not_testable    nothing named, and the truth listed among what this log cannot show
    right_sensor, wrong_sensor      verdict sensor_error with the right and a wrong explanation
    right_outside, wrong_outside    verdict outside_catalogue, right and wrong quantities
    complete        nothing hidden, nothing found

A wrong member always wins over what else is right: a name is what a user acts on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tests.hidden_effects.cases import OUTSIDE, Case

# What each kind of log counts as right.
RIGHT: dict[str, frozenset[str]] = {
    "one": frozenset({"exact"}),
    "twins": frozenset({"exact", "tied", "not_testable"}),
    "none": frozenset({"complete"}),
    "none_ar": frozenset({"complete"}),
    "two": frozenset({"exact"}),
    "outside": frozenset({"right_outside"}),
    "tied": frozenset({"exact", "tied", "not_testable"}),
    "hard": frozenset({"exact", "right_sensor"}),
}


def aliases_of(found: Mapping[str, Any]) -> dict[str, frozenset[str]]:
    """Candidate → those that it cannot be told from on this log."""
    return {
        candidate["effect"]: frozenset(candidate.get("indistinguishable_from", ()))
        for candidate in found.get("candidates", ())
    }


def not_testable(found: Mapping[str, Any]) -> frozenset[str]:
    """Effects of which the diagnosis says that this log cannot show them."""
    listed = {entry["effect"] for entry in found.get("not_testable", ())}
    listed |= {c["effect"] for c in found.get("candidates", ()) if c.get("testable") is False}
    return frozenset(listed)


def score(case: Case, found: Mapping[str, Any]) -> str:
    """The outcome of one diagnosis, a word of the module's list."""
    truth = frozenset(case.truth)
    selected = frozenset(found["selected"])
    aliases = aliases_of(found)
    verdict = found["verdict"]

    def meets(member: str) -> frozenset[str]:
        return truth & (aliases.get(member, frozenset()) | {member})

    if any(not meets(member) for member in selected):
        return "wrong" if truth or case.outside or case.sensor else "false_alarm"
    if verdict == "sensor_error":
        return _sensor(case, found)
    if verdict == "outside_catalogue":
        return _outside(case, found, truth, selected)
    if case.outside or case.sensor:
        # The verdict is a wrong one even where an effect that is there was named.
        return "missed"
    if not truth:
        return "complete" if verdict in ("complete", "missing_effect") else "false_alarm"
    met = frozenset().union(*(meets(member) for member in selected)) if selected else frozenset()
    if selected == truth:
        return "exact"
    if selected:
        return "tied" if met == truth else "part"
    best = _best_tie(found, aliases)
    if best and truth <= best and verdict == "not_identifiable":
        return "tied"
    return "not_testable" if truth <= not_testable(found) else "missed"


def _best_tie(found: Mapping[str, Any], aliases: Mapping[str, frozenset[str]]) -> frozenset[str]:
    """The first candidate with all that it cannot be told from."""
    for candidate in found.get("candidates", ())[:1]:
        tie = aliases[candidate["effect"]]
        return tie | {candidate["effect"]} if tie else frozenset()
    return frozenset()


def sensors_of(found: Mapping[str, Any]) -> list[str]:
    """Kinds of the sensors that are said to be wrong."""
    said = found.get("sensor") or []
    entries = [said] if isinstance(said, Mapping) else said
    return [str(entry["kind"]) for entry in entries]


def _sensor(case: Case, found: Mapping[str, Any]) -> str:
    kinds = sensors_of(found)
    if not case.sensor or not kinds:
        return "wrong_sensor"
    words = {"slope_offset": ("slope", "pitch"), "speed_scale": ("speed",)}[case.sensor]
    # One more sensor that is said to be wrong is one that a user would look for in vain.
    right = all(any(word in kind for word in words) for kind in kinds)
    return "right_sensor" if right else "wrong_sensor"


def _outside(
    case: Case, found: Mapping[str, Any], truth: frozenset[str], selected: frozenset[str]
) -> str:
    shape = found.get("outside_catalogue") or {}
    quantities = set(shape.get("quantities", ()))
    if not case.outside:
        return "wrong_outside" if truth or case.sensor else "false_alarm"
    needed, beside = OUTSIDE[case.outside]
    fits = needed in quantities and quantities <= {needed, *beside}
    return "right_outside" if fits and selected == truth else "wrong_outside"


def confidently_wrong(outcome: str) -> bool:
    """Whether a user who does as told adopts what is not there."""
    return outcome in ("wrong", "false_alarm", "wrong_sensor", "wrong_outside")
