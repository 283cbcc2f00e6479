"""Effects that are not identifiable from a log: why, and what would help.

untestable = Untestable(advice)
untestable.listed(["air_drag"])              # all of them, when air_drag is named
untestable.what_would_help("yaw_scrub")
"""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property

import numpy as np

from planner.arrays import Array
from planner.power.catalogue import all_effects
from planner.power.effect import Effect
from planner.telemetry.diagnosis.advice.experiments import (
    CLEARLY,
    USUAL_MINUTES,
    Advice,
    Option,
    left_after,
)
from planner.telemetry.diagnosis.results import HINTED, NotTestable
from planner.telemetry.selection import RankedTerm

HINT = 3.0
"""Standard errors from which an effect that is not named is mentioned."""
UNNOTICED = "it would go unnoticed "
"""How the reason begins that states the size up to which an effect is not seen."""


class Untestable:
    """What a log cannot show.

    Args:
        advice: for the log.
    """

    def __init__(self, advice: Advice) -> None:
        self.advice = advice
        self.examination, self.selection = advice.examination, advice.selection

    @cached_property
    def _usual_drives(self) -> list[Option]:
        return [option for option in self.advice.options if option.planned == USUAL_MINUTES]

    @cached_property
    def _alone(self) -> Array:
        """Standard deviations (options, C) of each column, by what the base could not imitate."""
        base = self.examination.evidence.tangent
        left = [
            np.diag(left_after(o.gram, base, np.arange(len(o.gram)))) for o in self._usual_drives
        ]
        return np.sqrt(np.maximum(np.stack(left), 0.0))

    def listed(self, selected: Collection[str]) -> tuple[NotTestable, ...]:
        """Effects that are not identifiable from this log, or hardly, and what would help.

        Args:
            selected: effects that are named.
        """
        testable, chosen = self.examination.testable, {m.name for m in self.selection.members}
        reasons = {slug: why for slug, why in testable.items() if why is not None}
        for slug in self.examination.unnoticed:
            if (why := self.examination.barely_testable(slug)) is not None:
                reasons[slug] = why
        for ranked in self.selection.ranking:
            z = self._beside(ranked, selected)
            if z > HINT and not ranked.member.sensor:
                but = (
                    "a later check does not confirm it"
                    if ranked.name in chosen
                    else "too little to name it"
                )
                reasons[ranked.name] = f"{HINTED}{z:.1f} standard errors, {but}"
        aliased = {alias for name in selected for alias in self.selection.aliases.get(name, ())}
        return tuple(
            NotTestable(slug, why, self.what_would_help(slug), *_cause(why))
            for slug, why in sorted(reasons.items())
            if slug not in {*selected, *aliased}
        )

    def _beside(self, ranked: RankedTerm, selected: Collection[str]) -> float:
        """Standard errors of an effect beside what is named."""
        named = [m for m in self.selection.members if m.name in selected]
        if not named or ranked.z <= HINT:
            return ranked.z
        given = [c for member in named for c in member.columns]
        mine = [c for c in ranked.member.columns if c not in given]
        evidence = self.examination.evidence
        return evidence.test(mine, given).z if mine else 0.0

    def what_would_help(self, slug: str) -> str:
        """What would make an effect testable, in one sentence."""
        missing = self.advice.missing(slug)
        competitors = self.examination.competitors
        columns = [
            (competitors.candidate(k), competitors.library.amplitudes[k])
            for k, c in enumerate(competitors.library.candidates)
            if c.effect == slug
        ]
        effect = all_effects().get(slug)
        if effect and effect.before_meter:
            return effect.how_to_measure
        if columns:
            at, amplitudes = zip(*columns, strict=True)
            apart = (self._alone[:, list(at)] * np.abs(amplitudes)).max(axis=1)
            if apart.max() > CLEARLY:
                return self._usual_drives[int(apart.argmax())].sentence
        if missing:
            return f"Log {' and '.join(missing)}."
        return (effect or Effect).how_to_measure


def _cause(why: str) -> tuple[str, str]:
    """What several effects have in common, and what is special to one."""
    if why.startswith(UNNOTICED) and "up to" in why:
        return UNNOTICED.strip(), why.removeprefix(UNNOTICED).partition(",")[0]
    if why.startswith(HINTED):
        size, _, but = why.removeprefix(HINTED).partition(", ")
        return f"{HINTED}but {but}", size
    return why, ""
