"""CPU time of a graph of 200 edges on the warehouse, and its energies against single plans.

    python -m tests.benchmarks.route_graph

Places are drawn at random where the body fits with any yaw; edges lead to near neighbours along
straight lines that can be driven, both ways.
"""

from __future__ import annotations

import math
import time

import numpy as np

from planner import energy_graph, plan_route
from planner.search.field import segment_cost
from planner.search.requests import MatrixRequest
from planner.search.resolution import ALL_YAWS
from planner.search.situation import situation_of
from tests.search.route_graphs import graph

EDGES, PLACES, APART, NEIGHBOURS, COMPARED = 200, 90, 1.2, 5, 40


def drawn_graph(seed: int = 1) -> tuple[list[dict[str, float]], list[tuple[int, int]]]:
    """Places and edges."""
    asked = MatrixRequest.from_json({"map": "warehouse", "starts": [{"x": 2, "y": 2}]})
    situation = situation_of(asked)
    field = situation.field("energy")
    rows, columns = np.nonzero(situation.ground.mask == ALL_YAWS)
    rng = np.random.default_rng(seed)
    places: list[tuple[float, float]] = []
    while len(places) < PLACES:
        k = rng.integers(len(rows))
        place = float(field.x0 + field.dx * columns[k]), float(field.y0 + field.dy * rows[k])
        if all(math.dist(place, other) > APART for other in places):
            places.append(place)
    edges: dict[tuple[int, int], None] = {}
    for i, place in enumerate(places):
        near = sorted(range(PLACES), key=lambda j: math.dist(place, places[j]))
        for j in near[1 : NEIGHBOURS + 1]:
            if math.isfinite(segment_cost(field, *place, *places[j], field.step)):
                edges |= dict.fromkeys([(i, j), (j, i)])
    return [{"x": x, "y": y} for x, y in places], list(edges)[:EDGES]


def main() -> None:
    """Measure, and print one line for each figure."""
    places, edges = drawn_graph()
    begun = time.process_time()
    found = energy_graph(map="warehouse", graph=graph(places, edges))
    print(f"{len(edges)} edges: {time.process_time() - begun:.1f} s of CPU time")
    ways = list(found.drives)[:: max(1, len(found.drives) // COMPARED)]
    worst = 0.0
    for way in ways:
        start, goal = (places[id_] for id_ in way)
        single = plan_route(map="warehouse", start=start, goal=goal).routes[0]
        worst = max(worst, abs(found.drives[way].energy_j / single.energy_j - 1.0))
    print(f"largest difference from {len(ways)} single plans: {worst:.2%}")


if __name__ == "__main__":
    main()
