"""Time of a graph of 200 edges on the warehouse, and its energies against single plans.

    python -m tests.benchmarks.route_graph [--through-racks]

Places are drawn at random where the body fits with any yaw; edges lead to near neighbours along
straight lines that can be driven, both ways; with --through-racks to any near neighbour, however
far the route leads around. The wall time is that of an idle machine only.
"""

from __future__ import annotations

import argparse
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


def drawn_graph(
    seed: int = 1, *, through: bool = False
) -> tuple[list[dict[str, float]], list[tuple[int, int]]]:
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
            straight = segment_cost(field, *place, *places[j], field.step)
            if through or math.isfinite(straight):
                edges |= dict.fromkeys([(i, j), (j, i)])
    return [{"x": x, "y": y} for x, y in places], list(edges)[:EDGES]


def main() -> None:
    """Measure, and print one line for each figure."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--through-racks", action="store_true")
    places, edges = drawn_graph(through=parser.parse_args().through_racks)
    begun, clock = time.process_time(), time.perf_counter()
    found = energy_graph(map="warehouse", graph=graph(places, edges))
    seconds, clock = time.process_time() - begun, time.perf_counter() - clock
    print(f"{len(edges)} edges: {seconds:.1f} s of CPU time, {clock:.1f} s", flush=True)
    ways = list(found.drives)[:: max(1, len(found.drives) // COMPARED)]
    worst = 0.0
    for way in ways:
        start, goal = (places[id_] for id_ in way)
        single = plan_route(map="warehouse", start=start, goal=goal).routes[0]
        worst = max(worst, abs(found.drives[way].energy_j / single.energy_j - 1.0))
    print(f"largest difference from {len(ways)} single plans: {worst:.2%}")


if __name__ == "__main__":
    main()
