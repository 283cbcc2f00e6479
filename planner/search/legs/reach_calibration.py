"""Routes to the edge of a reachable area, in full: what they take over what the field says.

    routes = EdgeRoutes(situation, field, [from_start], yaw, token)
    routes.drive(places)               # the nodes there that can be reached
    routes.ratios()                    # x, y, and the ratio there, of all up to now

Two neighbouring places may get routes on different sides of a hill, one needlessly expensive.
So each place also tries the paths of neighbours that do better.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.spatial import cKDTree

from planner.arrays import Array
from planner.cancellation import CancellationToken
from planner.quantities import STANDARD_GRAVITY
from planner.search.field import CostField
from planner.search.grid import CostToGo, grid_path
from planner.search.legs.single_leg import Leg, LegPlanner, Yaws
from planner.search.situation import Situation

Point = tuple[float, float]
Node = tuple[int, int]
"""Row and column."""
TRIED_NEIGHBOURS, LEARNING_PASSES = 4, 3
"""Nearest places whose paths a place may try, and how often what was learned is passed on."""
LEAST_RATIO_GAIN = 0.006
"""Share by which the neighbours' median ratio must be lower before a path of theirs is tried; less
is noise. Where only one or two of them do better, their paths hardly ever help."""


class EdgeRoutes:
    """Routes from a start to many places, or there and back."""

    def __init__(
        self,
        situation: Situation,
        field: CostField,
        fields: list[CostToGo],
        yaw: float | None,
        token: CancellationToken,
    ) -> None:
        self.situation, self.field, self.fields = situation, field, fields
        self.yaw, self.token = yaw, token
        self.planner = LegPlanner(situation, field, token, many=True)
        self.weight = situation.conditions.mass * STANDARD_GRAVITY
        self.legs: dict[Node, tuple[Leg, ...]] = {}
        self.refused: set[Node] = set()
        self.tried: set[tuple[Node, Node, float]] = set()

    def drive(self, places: list[Point]) -> list[Node]:
        """Drive to the nodes nearest to places; those of them to which a route is known.

        The others are ``refused``: a path leads there, but no motion keeps to all limits.
        """
        rows, columns = self.field.nodes_at(np.reshape(places, (-1, 2)))
        asked = list(dict.fromkeys(zip(rows.tolist(), columns.tolist(), strict=True)))
        new = [node for node in asked if node not in self.legs and node not in self.refused]
        with ThreadPoolExecutor(max_workers=2) as pool:
            for node, legs in zip(new, pool.map(self._driven, new), strict=True):
                if legs is not None:
                    self.legs[node] = legs
                else:
                    self.refused.add(node)
            for _ in range(LEARNING_PASSES):
                better = dict(pool.map(self._learned, *self._lessons()))
                self.legs |= {node: legs for node, legs in better.items() if legs is not None}
                if not any(better.values()):
                    break
        return [node for node in asked if node in self.legs]

    def ratio(self, node: Node) -> float:
        """Dissipated energy over the field's, at a node that was driven to."""
        spent = sum(leg.dissipated(self.weight) for leg in self.legs[node])
        return spent / self._expected(node)

    def ratios(self) -> tuple[Array, Array]:
        """Places (n, 2) that were driven to, m, and the ratios there (n,)."""
        places = np.array([self._place(node) for node in self.legs]).reshape(-1, 2)
        return places, np.array([self.ratio(node) for node in self.legs])

    def _place(self, node: Node) -> Point:
        # At nodes, where the field has its values.
        return self.field.x0 + node[1] * self.field.dx, self.field.y0 + node[0] * self.field.dy

    def _expected(self, node: Node) -> float:
        return sum(float(to_go.values[node]) for to_go in self.fields)

    def _yaws(self, to_go: CostToGo) -> Yaws:
        return (self.yaw, None) if to_go.from_start else (None, None)

    def _driven(self, node: Node) -> tuple[Leg, ...] | None:
        self.token.check()
        legs: list[Leg] = []
        if not math.isfinite(self._expected(node)):
            return None
        for to_go in self.fields:
            lattice = self.situation.lattice("energy", self.field)
            path = grid_path(self.field, lattice, to_go, self._place(node))
            if path is None:
                return None
            leg = self.planner.near(path, self._yaws(to_go))
            if leg is None:
                return None
            legs.append(leg)
        return tuple(legs)

    def _lessons(self) -> tuple[list[Node], list[Node]]:
        """Places whose neighbours do better, and for each the best one not tried there."""
        places, ratios = self.ratios()
        nodes = list(self.legs)
        pupils: list[Node] = []
        teachers: list[Node] = []
        if len(nodes) < 2:
            return pupils, teachers
        count = min(TRIED_NEIGHBOURS + 1, len(nodes))
        near = np.asarray(cKDTree(places).query(places, count)[1])
        for n, node in enumerate(nodes):
            neighbours = near[n][near[n] != n]
            likely = (1.0 - LEAST_RATIO_GAIN) * ratios[n]
            if np.median(ratios[neighbours]) >= likely:
                continue
            for m in neighbours[np.argsort(ratios[neighbours])]:
                key = node, nodes[m], float(ratios[m])
                if ratios[m] < likely and key not in self.tried:
                    self.tried.add(key)
                    pupils.append(node)
                    teachers.append(nodes[m])
                    break
        return pupils, teachers

    def _learned(self, node: Node, neighbour: Node) -> tuple[Node, tuple[Leg, ...] | None]:
        self.token.check()
        learn, before = self.planner.like_neighbour, self.legs[node]
        legs = tuple(
            leg if other.path is None else learn(leg, other.path, self._yaws(to_go))
            for to_go, leg, other in zip(self.fields, before, self.legs[neighbour], strict=True)
        )
        return node, None if all(a is b for a, b in zip(legs, before, strict=True)) else legs
