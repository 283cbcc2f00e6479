"""What a diagnosis of a laboratory's log is worth.

outcome(log, diagnosis_json) -> "exact", "tied", ...

exact           the effects named are the hidden ones, no more and no less; for "outside", the
                verdict and the quantity are right and no effect is wrong
tied            as exact, where a name stands with the true one that it cannot be told from
among           every hidden effect is named or in a tie, beside others that are not there
part            some of several hidden effects and nothing wrong
complete, sensor    nothing is hidden and nothing is named, or a sensor that really is wrong
abstained       not_identifiable, or the sensors' errors alone although an effect is hidden
missed          complete although something is hidden
quantity        outside the catalogue, over another quantity
wrong           an effect, a formula or a sensor that is not there, named without the true one
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tests.hidden_effects.laboratory.draw import Log
from tests.hidden_effects.laboratory.mechanisms import MECHANISMS
from tests.hidden_effects.scoring import aliases_of, sensors_of

OUTCOMES = ("exact", "tied", "among", "part", "complete", "sensor", "abstained", "missed")
OUTCOMES += ("quantity", "wrong", "error")


def outcome(log: Log, found: Mapping[str, Any]) -> str:
    """One word of the module's list."""
    truth = log.truth.there
    selected = frozenset(found["selected"])
    aliases = aliases_of(found)
    ties = {member: aliases.get(member, frozenset()) | {member} for member in selected}
    met = frozenset[str]().union(*(truth & tie for tie in ties.values()))
    extra = [member for member, tie in ties.items() if not tie & truth]
    verdict = found["verdict"]
    wrong_sensor = verdict == "sensor_error" and not (
        set(sensors_of(found)) <= log.truth.instruments.wrong_sensors
    )
    formula = found.get("outside_catalogue") is not None
    if log.truth.outside:
        if extra or wrong_sensor:
            return "wrong"
        return _over(log, found) if formula else _nothing_named(verdict)
    if extra or wrong_sensor or formula:
        return "among" if truth and met == truth else "wrong"
    if selected == truth and truth:
        return "exact"
    if selected:
        return "tied" if met == truth else "part"
    if not truth:
        return {"complete": "complete", "sensor_error": "sensor"}.get(verdict, "abstained")
    return _nothing_named(verdict)


def _nothing_named(verdict: str) -> str:
    return "missed" if verdict == "complete" else "abstained"


def _over(log: Log, found: Mapping[str, Any]) -> str:
    mechanism = MECHANISMS[log.truth.outside]
    quantities = set((found.get("outside_catalogue") or {}).get("quantities", ()))
    right = set(mechanism.quantities) & quantities
    rest = quantities - {*mechanism.quantities, *mechanism.beside}
    return "exact" if right and not rest else "quantity"
