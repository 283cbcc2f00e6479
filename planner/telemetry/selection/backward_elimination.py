"""Backward elimination: a member beside others must lower the held-out error.

    found = without_unsupported(found, watch)

Evidence within a log counts every row. A shape that fits the runs of one log a little better need
not be an effect that the next run has. So each member is left out in turn, the rest is fitted
again, and both fits are compared on held-out runs.
"""

from __future__ import annotations

from dataclasses import replace

from planner.progress import Progress
from planner.telemetry.holdout import rms, supports
from planner.telemetry.selection.found import Found


def without_unsupported(found: Found, watch: Progress) -> Found:
    """Drop members that do not lower the held-out error.

    The rule is that of every claim (planner.telemetry.holdout.supports). Of a single member the
    decision asks it. ``watch`` hears of every fit, and raises when the caller cancelled.
    """
    if any(m.sensor for m in found.selection.members):
        return found
    members = list(found.selection.members)
    while len(members) > 1:
        residual = found.heldout(found.fitted)
        unsupported = []
        for k, member in enumerate(members):
            watch(0.9, f"fitting without {member.name}")
            rest = tuple(a for j, a in enumerate(found.additions) if j != k)
            fitted = found.refit(rest)
            without = found.heldout(fitted)
            if not supports(found.log, without, residual, found.base.spread):
                unsupported.append((rms(without), k, rest, fitted))
        if not unsupported:
            break
        _, k, rest, fitted = min(unsupported, key=lambda entry: entry[0])
        members.pop(k)
        selection = replace(found.selection, members=tuple(members))
        found = replace(found, selection=selection, additions=rest, fitted=fitted)
    return found
