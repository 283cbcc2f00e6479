"""Backward elimination: a member beside others must lower the held-out error.

    found = without_unsupported(found, watch)

Evidence within a log counts every row. A shape that fits the runs of one log a little better need
not be an effect that the next run has. So each member is left out in turn, the rest is fitted
again, and both fits are compared on held-out runs.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from planner.arrays import Array
from planner.progress import Progress
from planner.telemetry.holdout import heldout_residual
from planner.telemetry.noise import huber
from planner.telemetry.selection.selection_loop import Found

LEAST_LOSS_SHARE = 0.05
"""Share of the held-out loss that a member beside others must take off, unless LEAST_RUNS_Z
holds."""
LEAST_RUNS_Z = 1.64
"""z over runs of the loss that a member takes off, 5 % on one side."""


def without_unsupported(found: Found, watch: Progress) -> Found:
    """Drop members that do not lower the held-out error.

    A member stays that takes a fair share of it, or a smaller one in most runs. Of a single member
    the report asks the same. ``watch`` hears of every fit, and raises when the caller cancelled.
    """
    if any(m.sensor for m in found.selection.members):
        return found
    members = list(found.selection.members)
    while len(members) > 1:
        residual = heldout_residual(found.log, found.fitted)
        gains = []
        for k, member in enumerate(members):
            watch(0.9, f"fitting without {member.name}")
            rest = tuple(a for j, a in enumerate(found.additions) if j != k)
            fitted = found.refit(rest)
            without = heldout_residual(found.log, fitted)
            gains.append((_gain(found, without, residual), k, rest, fitted))
        least, k, rest, fitted = min(gains, key=lambda entry: entry[0])
        if least >= 1.0:
            break
        members.pop(k)
        selection = replace(found.selection, members=tuple(members))
        found = replace(found, selection=selection, additions=rest, fitted=fitted)
    return found


def _gain(found: Found, without: Array, residual: Array) -> float:
    """What a member takes off held-out errors, in units of what it has to."""
    _, run = np.unique(found.log.run, return_inverse=True)
    best = -math.inf
    # A few rows near rest may outweigh all others in the squares
    # (planner.telemetry.holdout.heldout).
    for loss in (np.square, lambda r: huber(r / found.base.spread)):
        before, after = loss(without), loss(residual)
        share = 1.0 - float(after.mean() / before.mean())
        by_run = np.bincount(run, before - after) / np.bincount(run)
        scatter = float(by_run.std(ddof=1)) / math.sqrt(len(by_run)) if len(by_run) > 1 else 0.0
        z = float(by_run.mean()) / scatter if scatter > 0.0 else 0.0
        best = max(best, share / LEAST_LOSS_SHARE, z / LEAST_RUNS_Z)
    return best
