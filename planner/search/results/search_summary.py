"""How an answer was found: the ``planner`` part of ROUTE.json."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any


@dataclass(frozen=True)
class SearchSummary:
    """How an answer was found. What does not apply is None and is left out of JSON.

    Attributes:
        name, space, objective, seed: as requested.
        status: OMPL's word for how the search ended, such as "Exact solution".
        chosen: what found the route.
        slope_margin: share of the slope limit that the grid was searched with.
        grid_energy_j: J of the best route before the time budget was spent.
        iterations, edges_evaluated: of a sampling planner.
        path_cost: of a sampling planner's path, as its objective counts.
        bound: class of motions that the lower bound holds for.
        bound_s: seconds that a closer one took.
    """

    name: str
    space: str
    objective: str
    seed: int
    status: str = "Unknown"
    chosen: str | None = None
    slope_margin: float | None = None
    grid_energy_j: float | None = None
    iterations: int | None = None
    edges_evaluated: int | None = None
    path_cost: float | None = None
    bound: str | None = None
    bound_s: float | None = None

    def to_json(self) -> dict[str, Any]:
        """What applies, by name."""
        values = ((part.name, getattr(self, part.name)) for part in fields(self))
        return {name: value for name, value in values if value is not None}
