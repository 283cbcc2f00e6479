"""A sampling planner of OMPL's in a process of its own, as its random seed is set once a process.

    found = in_fresh_process(Sampling("bit*", costs, start, goal, seed=0, seconds=2.0), token)

``python -m planner.search.ompl`` is that process's program.
"""

from __future__ import annotations

import math
import pickle
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeVar

from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from planner.arrays import Array
from planner.cancellation import POLL_SECONDS, CancellationToken
from planner.search.ompl.costs import MotionCosts
from planner.search.ompl.parts import word_for
from planner.search.ompl.problem import Frame
from planner.search.requests import PoseRequest

SAMPLERS = {"bit*": og.BITstar, "rrt*": og.RRTstar, "informed-rrt*": og.InformedRRTstar}
"""OMPL's planners by name, which improve their path for as long as they run."""


T = TypeVar("T", covariant=True)


class Task(Protocol[T]):
    """What a process of its own works out; it and its result can be pickled."""

    def run(self) -> T:
        """Work it out, in a process that has not used OMPL's random numbers before."""


@dataclass(frozen=True)
class Sampling:
    """What a sampling planner is asked.

    Attributes:
        planner: of SAMPLERS.
        costs: of straight motions.
        start, goal: with the yaw asked for.
        seed: of OMPL's random numbers.
        seconds: time limit, unless ``iterations`` is given.
        iterations: limit that makes the path reproducible.
    """

    planner: str
    costs: MotionCosts
    start: PoseRequest
    goal: PoseRequest
    seed: int
    seconds: float
    iterations: int | None = None

    def prepared(self) -> tuple[Frame, Any]:
        """OMPL's parts, and a SimpleSetup with the planner."""
        ou.setLogLevel(ou.LOG_NONE)
        ou.RNG.setSeed(self.seed + 1)  # OMPL refuses 0
        frame = Frame(self.costs)
        # Compiled code is loaded before time counts.
        start = (self.start.x, self.start.y, 0.0)[: 3 if self.costs.poses else 2]
        self.costs.between(start, (start[0] + self.costs.field.dx, *start[1:]))
        setup = frame.between(self.start, self.goal)
        setup.setPlanner(SAMPLERS[self.planner](frame.information))
        setup.setup()
        return frame, setup

    def run(self) -> Sampled:
        """Plan."""
        frame, setup = self.prepared()
        asked, until = 0, time.perf_counter() + self.seconds

        def finished() -> bool:
            nonlocal asked
            asked += 1
            if self.iterations is not None:
                return asked > self.iterations
            return time.perf_counter() > until

        status = setup.solve(ob.PlannerTerminationCondition(finished))
        path, cost = None, math.inf
        if setup.haveExactSolutionPath():
            found = setup.getSolutionPath()
            path, cost = frame.points(found), found.cost(frame.objective).value()
        return Sampled(word_for(status), path, cost, asked, frame.reader.evaluations)


class Sampled(NamedTuple):
    """What a sampling planner found.

    Attributes:
        status: OMPL's word for how it ended.
        path: (k, 2) m; None where nothing was found.
        cost: of the path, as the objective counts.
        iterations: of the planner.
        evaluations: motions whose cost was worked out.
    """

    status: str
    path: Array | None
    cost: float
    iterations: int
    evaluations: int


def in_fresh_process(task: Task[T], token: CancellationToken) -> T:
    """Work out a task in a new process.

    Raises:
        Cancelled: the caller wants to stop; the process is ended.
        RuntimeError: the process failed; with what it wrote.
    """
    with ExitStack() as files:
        asked, reply, errors = (files.enter_context(tempfile.TemporaryFile()) for _ in range(3))
        pickle.dump(task, asked)
        asked.seek(0)
        command = [sys.executable, "-m", "planner.search.ompl"]
        with subprocess.Popen(command, stdin=asked, stdout=reply, stderr=errors) as process:
            try:
                while process.poll() is None:
                    token.check()
                    with suppress(subprocess.TimeoutExpired):
                        process.wait(POLL_SECONDS)
            finally:
                process.kill()
        if process.returncode:
            errors.seek(0)
            raise RuntimeError(errors.read().decode(errors="replace"))
        reply.seek(0)
        found: T = pickle.load(reply)
        return found


def main() -> None:
    """Read a task from standard input and write its result to standard output."""
    pickle.dump(pickle.load(sys.stdin.buffer).run(), sys.stdout.buffer)
