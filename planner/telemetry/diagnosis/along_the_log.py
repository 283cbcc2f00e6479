"""What rises with the distance driven, and what else may change along a log.

    decided = all_rising_steadily(decided)     # wear, where no other course explains the log

Distance only grows. So does the time, in which electronics warm up, and a second day may have
another ground. Held-out runs cannot tell wear from these, as each lies between others. So wear
competes with other courses of the power: one that rises with the distance whatever the drag, and
one, or all drag, that steps up or down once between two runs. Where one of them predicts held-out
runs as well, the log does not show wear.

Left out
    drag that rises for another reason, such as a ground that becomes wet: it is wear to a log.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner.arrays import Array
from planner.quantities import INDEX
from planner.telemetry.diagnosis.answer import Answer, Decision
from planner.telemetry.diagnosis.reconcile import without_claim
from planner.telemetry.diagnosis.unexplained import unexplained_by
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import rms, supports
from planner.telemetry.logs import Telemetry
from planner.telemetry.noise import counted
from planner.telemetry.selection import Found

RISING = "wear"
"""The effect that only grows along a log."""
LOG_PARTS = 20
"""Parts of a log, between which something may step; of many runs, between the nearest two."""
RUNS_WITH_STEPS = 3
"""Runs up to which something may also step within one."""
COURSE_SIZE = 3.0
"""Residuals (rms) that a standard deviation of a course makes: its prior must not hold it back."""


def all_rising_steadily(decided: Sequence[tuple[Found, Decision]]) -> list[tuple[Found, Decision]]:
    """Searches with decisions, none of which names wear unless all that do hold it up.

    Around another model a course may look worse than it is.
    """
    held = [(found, rising_steadily(found, one)) for found, one in decided]
    if all(
        _wears(one) == _wears(other) for (_, one), (_, other) in zip(decided, held, strict=True)
    ):
        return held
    return [(found, without_claim(found, one) if _wears(one) else one) for found, one in held]


def _wears(decision: Decision) -> bool:
    return any(member.name == RISING for member in decision.answer.members)


def rising_steadily(found: Found, decision: Decision) -> Decision:
    """A decision; without wear where another course along the log explains it as well.

    Args:
        found: state of the search that was decided.
        decision: what was decided.
    """
    answer, floor = decision.answer, decision.floor
    kept = [k for k, member in enumerate(answer.members) if member.name != RISING]
    if len(kept) == len(answer.members) or answer.proposal is not None:
        return decision
    additions = tuple(answer.additions[k] for k in kept)
    without = found.refit(additions) if kept else found.base
    others = found.heldout(without)
    # What differs from run to run is what the courses say, so that it is no noise.
    noise = replace(without.noise, by_run=np.zeros((2, 2)))
    competing, size = replace(without, noise=noise), COURSE_SIZE * rms(others)
    each = (found.heldout(competing, size * c[:, None]) for c in _courses(found.log, answer.fit))
    if min(rms(counted(one, floor)) for one in each) > rms(counted(answer.left, floor)):
        return decision
    if not (kept and supports(found.log, decision.before, others, floor)):
        return without_claim(found, decision)
    members = tuple(answer.members[k] for k in kept)
    rest = Answer(without, others, members, additions, aliases=answer.aliases)
    left = unexplained_by(found.log, others, floor, without.watts)
    return replace(decision, answer=rest, alike=(), unexplained=left, near="")


def _courses(log: Telemetry, fitted: Fit) -> Iterator[Array]:
    """(n,) other courses of the power along the log, each of a mean square of 1.

    Args:
        log: the rows.
        fitted: the model with wear, whose column says what all drag takes.
    """
    slots = [fitted.model.slots[place][0].slug for place in fitted.places]
    driven = log.rows[:, INDEX["odometer"]]
    drag = fitted.columns[:, slots.index(RISING)] / np.maximum(driven, 1e-9)
    stepped = (amount * after for after in _steps(log) for amount in (np.ones(len(log)), drag))
    for course in (driven, *stepped):
        if (size := rms(course)) > 0.0:
            yield course / size


def _steps(log: Telemetry) -> Iterator[Array]:
    """(n,) 1 in all rows from some moment on, for every moment at which something may change."""
    moments = np.arange(1, LOG_PARTS) * len(log) // LOG_PARTS
    starts = np.array([start for start, _ in log.run_pieces()])
    if len(starts) > RUNS_WITH_STEPS:
        moments = np.unique(starts[np.abs(starts[:, None] - moments).argmin(axis=0)])
    for moment in moments[moments > 0]:
        yield (np.arange(len(log)) >= moment).astype(float)
