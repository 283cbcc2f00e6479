"""Further candidates for the least energy, while a time budget lasts.

    for candidate in further_candidates(run, attempt): ...

The grid searches again with perturbed edge costs, for paths that cost about the same and end in
other homotopy classes once they are smoothed. The best of these paths are smoothed with other
waypoint distances and corner penalties. Then waypoint descent moves the waypoints of the best ones
while their trajectories get cheaper. In the time that is left, those of the very best are moved and
driven (driven_moves).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter

from planner.arrays import Array
from planner.search.field import CostField
from planner.search.results import Route
from planner.search.run import Run
from planner.search.solve.driven_moves import with_moves_driven
from planner.search.solve.grid_planner import near_path_of
from planner.search.solve.pipeline import Attempt, Candidate, drive_legs
from planner.search.solve.sketch import Legs, with_costs
from planner.search.waypoints import optimise_waypoints, refine

PERTURBATION, GRAIN = 0.03, 3.0
"""Standard deviation of the logarithm of a perturbed cost, and its grain in cells: paths that cost
about the same before they are smoothed come out in turn."""
SEARCHES = 6
"""Searches where iterations are given, which make an answer reproducible."""
SMOOTHED_AGAIN = 4
"""Paths that are smoothed otherwise."""
WAYPOINT_CELLS, PENALTY_SHARES = (4.0, 8.0, 6.0, 12.0, 3.0, 16.0), (1.0, 0.3, 0.1, 3.0)
"""Cells between waypoints, and shares of the corner penalty, that paths are smoothed with."""
IN_THE_OPEN, AMONG_OBSTACLES = (0.6, 0.4, 0.0), (0.8, 0.7, 0.65)
"""Shares of the time budget that are left at least when searching, smoothing and descent end; then
waypoints are moved and driven. Among obstacles that saves most: limits hold the speed down at tight
corners. In the open, paths beside the best one do."""
DESCENT_CELLS = (1.0, 0.5, 0.5, 0.25, 0.25, 0.1)
"""Cells by which waypoint descent moves waypoints, round after round."""
DESCENDED = {24.0: 4, 12.0: 2, 16.0: 1}
"""How many candidates get their waypoints optimised, by the cells between waypoints."""
LEAST_STEP_S = 0.15
"""s left from which another step is begun."""


def further_candidates(run: Run, attempt: Attempt) -> Iterator[Candidate]:
    """Candidates for as long as the time budget lasts.

    Args:
        run: the request.
        attempt: what the grid came to, with legs.

    Raises:
        Cancelled: the caller wants to stop, or the time is up within a step.
    """
    request = run.request
    counted = request.iterations is not None
    given = counted or "time_budget_s" in request.model_fields_set
    if request.objective != "energy" or not given:
        return

    shares = AMONG_OBSTACLES if run.ground.blocked.any() else IN_THE_OPEN
    for_smoothing, for_descent, for_moves = (share * request.time_budget_s for share in shares)
    found: list[tuple[Route, Legs, list[Array]]] = []
    if attempt.route is not None and attempt.legs is not None:
        found.append((attempt.route, attempt.legs, attempt.paths or []))
    others = other_paths(run, attempt)
    for number in itertools.count():
        if counted and number == SEARCHES:
            return
        if run.seconds_left < max(LEAST_STEP_S, for_smoothing):
            break
        source, other = next(others)
        if other.route is not None and other.legs is not None:
            yield Candidate(other.route, source, other.legs)
            found.append((other.route, other.legs, other.paths or []))
    found.sort(key=lambda one: one[0].energy_j)
    known = [(route, legs) for route, legs, _ in found]
    best = [paths for _, _, paths in found[:SMOOTHED_AGAIN] if paths]
    for candidate in itertools.chain(
        smoothed_otherwise(run, attempt.field, best, lambda: run.seconds_left - for_descent),
        with_waypoints_optimised(run, attempt.field, known, lambda: run.seconds_left - for_moves),
    ):
        yield candidate
        known.append((candidate.route, candidate.legs))
    if known:
        route, legs = min(known, key=lambda one: one[0].energy_j)
        begin = Candidate(route, "best so far", legs)
        field = run.field("energy", attempt.field.margin)
        yield from with_moves_driven(run, field, begin, lambda: run.seconds_left > LEAST_STEP_S)


def other_paths(run: Run, attempt: Attempt) -> Iterator[tuple[str, Attempt]]:
    """Attempts with perturbed costs, without end, each with the name of its source."""
    own, random = attempt.field, np.random.default_rng(run.request.seed)
    for number in itertools.count(1):
        run.step(0.6, "other homotopy classes")
        grain = gaussian_filter(random.standard_normal(own.heights.shape), GRAIN)
        factor = own.factor * np.exp(PERTURBATION / grain.std() * grain)
        other = near_path_of(run, own, factor, run.request.objective)
        yield f"perturbed costs {number}", other


def smoothed_otherwise(
    run: Run, field: CostField, paths: list[list[Array]], left: Callable[[], float]
) -> Iterator[Candidate]:
    """Paths smoothed with other waypoints and penalties than a search has time for, two at once."""
    penalty = run.situation.corner_penalty("energy")
    field = run.field("energy", field.margin)

    def smoothed(cells: float, share: float, path: list[Array]) -> tuple[Legs, object]:
        legs = [
            refine(field, leg, penalties=[share * penalty], waypoint_cells=cells, check=run.check)[
                0
            ]
            for leg in path
        ]
        return legs, drive_legs(run, field, legs, "energy")

    kinds = sorted(
        itertools.product(WAYPOINT_CELLS, PENALTY_SHARES),
        key=lambda kind: WAYPOINT_CELLS.index(kind[0]) + PENALTY_SHARES.index(kind[1]),
    )
    tasks = [partial(smoothed, *kind, path) for kind in kinds for path in paths]
    for first in range(0, len(tasks), 2):
        if left() < LEAST_STEP_S:
            return
        run.step(0.75, "other smoothings")
        for legs, route in run.other_core.all(tasks[first : first + 2]):
            if isinstance(route, Route):
                yield Candidate(route, "smoothed otherwise", legs)


def with_waypoints_optimised(
    run: Run, field: CostField, known: list[tuple[Route, Legs]], left: Callable[[], float]
) -> Iterator[Candidate]:
    """The best routes with their waypoints moved, then with closer waypoints, while that helps."""
    field = run.field("energy", field.margin)
    known = list({round(route.energy_j, 6): (route, legs) for route, legs in known}.values())
    for cells, count in DESCENDED.items():
        known.sort(key=lambda one: one[0].energy_j)
        for k, (route, legs) in enumerate(known[:count]):
            if left() < LEAST_STEP_S:
                return
            run.step(0.85, "waypoint descent")
            better = optimise_waypoints(
                field,
                run.conditions,
                [path for path, _ in legs],
                run.yaws,
                steps=itertools.takewhile(lambda _: left() > LEAST_STEP_S, DESCENT_CELLS),
                spacing=cells,
                both=run.other_core.all,
                check=run.check,
            )
            moved = with_costs(field, better.legs)
            now = drive_legs(run, field, moved, "energy")
            if isinstance(now, Route) and now.energy_j < route.energy_j:
                known[k] = now, moved
                yield Candidate(now, "waypoint descent", moved)
