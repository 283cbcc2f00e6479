"""Searches near limits of torque: paths on gentler slopes, and runs with the other limit.

    if near_torque_limits(run, field, attempt, "energy"):
        attempt = or_gentler(run, field, attempt, "energy", ANSWER, SLOPE_MARGINS[1:])
    other = with_other_torque(run, attempt, ANSWER)     # None where there is nothing to try

The costs of a search are those of even driving. What bends, rests and warm motors cost shows once
a path is driven, so that another path may be better.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from planner.search.field import CostField, polyline_cost
from planner.search.run import Run
from planner.search.solve.descent import MOST_SAVED
from planner.search.solve.grid_paths import leg_paths
from planner.search.solve.pipeline import Attempt, finished
from planner.search.solve.sketch import Closely, Effort, Sketch, sketch
from planner.search.waypoints import suggests_detour

MOST_TORQUE = 0.95
"""Share of a limit of torque from which it decides how bends are driven; where traction or voltage
does, motions on steep ground use clearly less."""


def near_torque_limits(run: Run, field: CostField, attempt: Attempt, objective: str) -> bool:
    """Whether limits of torque cost a route much beside its metres, or leave none at all.

    The costs of the search are those of even driving for a moment. They hold neither the torque of
    bends on steep ground, nor rests, nor the mean torque.
    """
    route = attempt.route
    if route is None:
        return _too_warm(attempt)
    assert route.motion is not None  # as ``drive`` leaves it
    if len(route.motion.rests):
        return True
    if objective != "energy" or not suggests_detour(
        run.conditions, attempt.spent(run, "energy"), attempt.metres(field)
    ):
        return False
    shares = [use.share for use in route.limits if use.limit.startswith("torque")]
    return max(shares) >= MOST_TORQUE


def or_gentler(
    run: Run,
    field: CostField,
    attempt: Attempt,
    objective: str,
    effort: Effort,
    margins: Iterable[float],
) -> Attempt:
    """A route, or the best of those on gentler slopes while the metres of these cost less."""
    best = attempt
    with run.within_budget() as limited:
        for margin in margins:
            costs = run.field(objective, margin, field.factor)
            paths = leg_paths(limited, costs, objective)
            if paths is None:
                break
            metres = sum(polyline_cost(costs, path, costs.step) for path in paths)
            if best.route is not None and metres >= best.spent(run, objective):
                break
            roughly = sketch(limited, costs, paths, objective, effort)
            if objective == "energy" and not _may_cost_less(roughly, best):
                continue
            found = finished(limited, [roughly], objective, effort, Closely(objective))
            best = min(best, found, key=lambda one: one.value(objective))
    return best


def _too_warm(attempt: Attempt) -> bool:
    """Whether motors that get too warm refused some path."""
    infeasible = attempt.infeasible
    return attempt.too_warm or (infeasible is not None and infeasible.too_warm)


def _may_cost_less(roughly: Sketch, than: Attempt) -> bool:
    """Whether a sketch, driven with all care, may come below a route."""
    one = roughly.best
    if one is None or than.route is None:
        return one is not None
    return one.energy - MOST_SAVED * one.dissipated < than.route.energy_j


def with_other_torque(run: Run, attempt: Attempt, effort: Effort) -> Run | None:
    """The run with a limit of torque that may let a search find what this one did not."""
    situation = run.situation
    if run.conditions.lasting:
        # A short slope may take more than the continuous torque.
        if not effort.closely or situation.slopes_outlast_heat:
            return None
        return replace(run, situation=situation.with_peak_torque())
    if not _too_warm(attempt):
        return None
    # What never exceeds the continuous torque keeps the limit of its mean.
    return replace(run, situation=situation.with_continuous_torque())
