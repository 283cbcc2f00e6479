"""Planners side by side, run by OMPL's own Benchmark, with the energy of driving their paths.

comparison = compare_planners(map="cone", start={"x": 6, "y": 20}, goal={"x": 34, "y": 20})
for run in comparison.runs:
    run.planner, run.seconds, run.energy_j
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from os import PathLike
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from ompl import tools
from ompl import util as ou

from planner.cancellation import CancellationToken
from planner.errors import RequestError
from planner.power.model import PowerModel
from planner.progress import Progress, silent
from planner.search.ompl.costs import State
from planner.search.ompl.least_energy import LeastEnergy
from planner.search.ompl.problem import EnergyProblem, Frame, waypoints
from planner.search.ompl.sampling import SAMPLERS, Sampling, in_fresh_process
from planner.search.requests import PlanRequest, RequestLike
from planner.search.results import Route
from planner.search.run import Run
from planner.search.situation import Situation
from planner.search.solve import Found, best_along, best_route, summary_of
from planner.shown import Shown, frame
from planner.terrain.heightmap import Terrain

if TYPE_CHECKING:
    import pandas

MEMORY_MB = 1e6
"""MB that a planner may use: no limit that matters."""
ENOUGH_S = 600.0
"""s for least-energy, which ends by itself."""


@dataclass(frozen=True)
class PlannerRun:
    """One run of one planner.

    Attributes:
        planner: its name in requests.
        seconds: that it planned.
        cost: of its path, as the objective counts; None where it found nothing.
        energy_j: J of the best route along its path; None where there is none.
        route: that route.
    """

    planner: str
    seconds: float
    cost: float | None
    route: Route | None

    @property
    def energy_j(self) -> float | None:
        """J of the best route along its path."""
        return None if self.route is None else self.route.energy_j

    def to_json(self) -> dict[str, Any]:
        """The run ready for JSON."""
        found = {"planner": self.planner, "seconds": self.seconds, "cost": self.cost}
        return {**found, "energy_j": self.energy_j}


@dataclass(frozen=True)
class PlannerComparison(Shown):
    """What ``compare_planners`` returns.

    Attributes:
        terrain: the map.
        model: the power model that priced the routes.
        space: "plane" or "poses".
        seconds: time limit of each run of a sampler.
        runs: planner by planner.
    """

    terrain: Terrain
    model: dict[str, Any]
    space: str
    seconds: float
    runs: tuple[PlannerRun, ...]

    @property
    def solved(self) -> list[PlannerRun]:
        """Runs that came to a route."""
        return [run for run in self.runs if run.route is not None]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """One row for each planner: runs, solved, medians of seconds and energy, and the excess.

        ``extra_share`` is the median energy beyond that of least-energy, as a share of it.
        """
        rows: list[dict[str, Any]] = []
        for name in dict.fromkeys(run.planner for run in self.runs):
            own = [run for run in self.runs if run.planner == name]
            energies = [run.energy_j for run in own if run.energy_j is not None]
            rows.append(
                {
                    "planner": name,
                    "runs": len(own),
                    "solved": len(energies),
                    "seconds": median(run.seconds for run in own),
                    "energy_j": median(energies) if energies else None,
                }
            )
        least = rows[0]["energy_j"]
        for row in rows:
            known = row["energy_j"] is not None and least
            row["extra_share"] = (row["energy_j"] - least) / abs(least) if known else None
        return rows

    def to_json(self) -> dict[str, Any]:
        """The comparison ready for JSON."""
        return {
            "space": self.space,
            "seconds": self.seconds,
            "planners": self.rows,
            "runs": [run.to_json() for run in self.runs],
            "model": dict(self.model),
        }

    def to_frame(self) -> pandas.DataFrame:
        """``rows`` as a DataFrame, one row for each planner."""
        return frame(self.rows)


def compare_planners(
    request: PlanRequest | RequestLike = None,
    *,
    seconds: float = 2.0,
    runs: int = 3,
    terrain: Terrain | None = None,
    model: PowerModel | str | PathLike[str] | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    **fields: Any,
) -> PlannerComparison:
    """Run least-energy and OMPL's samplers on one request.

    Args:
        request: as for ``plan_route``; its ``planner`` is ignored.
        seconds: time limit of each run of a sampler.
        runs: of each sampler; least-energy has no random numbers, and runs once until it ends.
        terrain, model: already there, instead of those that the request names.
        progress: called with the share done, 0 to 1, and what is being done.
        cancelled: asked before every run; True raises Cancelled.
        fields: fields of the request, over those of ``request``.

    Raises:
        RequestError, MapError, VehicleError, ModelError: something given cannot be used.
        Cancelled: ``cancelled`` returned True.
    """
    checked, situation = Situation.asked(PlanRequest, request, fields, terrain, model)
    asked = checked.model_dump(exclude_unset=True)
    if asked.get("via"):
        raise RequestError("via", "is not for samplers", accepted="a request without via places")
    ou.setLogLevel(ou.LOG_NONE)
    token = CancellationToken(cancelled)
    watched = token.watched(progress or silent)
    watched(0.0, "least-energy")
    given = {"terrain": situation.ground.terrain, "model": situation.conditions.model}
    problem = EnergyProblem(**{**asked, **given})
    problem.run = replace(problem.run, token=token)
    own = _of_least_energy(problem)
    for k, name in enumerate(SAMPLERS):
        watched((k + 1) / (1 + len(SAMPLERS)), name)
        own += _of_sampler(problem, name, seconds, runs)
    watched(1.0, "done")
    return PlannerComparison(
        problem.run.ground.terrain,
        dict(problem.run.conditions.model.describe()),
        problem.run.request.space,
        seconds,
        tuple(own),
    )


class Trial(NamedTuple):
    """One run by OMPL's Benchmark: its time, and the states and the cost of its path, if any."""

    seconds: float
    states: list[State]
    cost: float


@dataclass(frozen=True)
class Trials:
    """Runs of a sampling planner, for a process of its own."""

    sampling: Sampling
    count: int

    def run(self) -> list[Trial]:
        """Run them."""
        frame, setup = self.sampling.prepared()
        return trials(frame, setup, self.sampling.seconds, self.count)


def trials(frame: Frame, setup: Any, seconds: float, count: int) -> list[Trial]:
    """Runs of a setup's planner by OMPL's Benchmark, each of at most so many seconds."""
    bench = tools.Benchmark(setup, "joulepath")
    bench.addPlanner(setup.getPlanner())
    request = tools.Request()
    request.maxTime, request.maxMem, request.runCount = seconds, MEMORY_MB, count
    # Or OMPL writes a file of its own into the working folder.
    request.saveConsoleOutput = request.displayProgress = request.simplify = False
    reader, found = frame.reader, list[Trial]()

    def ran(planner: Any, properties: Any) -> None:
        # Knows numbers only: reference cycles through OMPL's objects never end.
        definition, states = planner.getProblemDefinition(), list[State]()
        if definition.hasExactSolution():
            states = [reader.read(state) for state in definition.getSolutionPath().getStates()]
        cost = sum(reader.costs.between(a, b) for a, b in pairwise(states))
        found.append(Trial(float(properties["time REAL"]), states, cost))

    bench.setPostRunEvent(ran)
    bench.benchmark(request)
    return found


def _of_least_energy(problem: EnergyProblem) -> list[PlannerRun]:
    outcomes: list[Found] = []

    def search(run: Run) -> Found:
        outcomes.append(best_route(run))
        return outcomes[-1]

    setup = problem.setup()
    setup.setPlanner(LeastEnergy(problem.information, search))
    [(spent, states, cost)] = trials(problem, setup, ENOUGH_S, 1)
    route = outcomes[0].route
    return [PlannerRun("least-energy", spent, cost if states else None, route)]


def _of_sampler(problem: EnergyProblem, name: str, seconds: float, count: int) -> list[PlannerRun]:
    run = problem.run
    poses = run.poses[0], run.poses[-1]
    sampling = Sampling(name, problem.reader.costs, *poses, run.request.seed, seconds)
    runs = []
    for spent, states, cost in in_fresh_process(Trials(sampling, count), run.token):
        if not states:
            runs.append(PlannerRun(name, spent, None, None))
            continue
        found = best_along(run, [waypoints(states)], summary_of(run), compared=False)
        runs.append(PlannerRun(name, spent, cost, found.route))
    return runs
