"""The steepest potential in known costs falls by the distance, or by the way round."""

from __future__ import annotations

import math

import numpy as np

from planner.search.certificate.potential import levelled, steepest_potential, weights_at


def test_potential_in_an_even_cost_is_distance() -> None:
    """With |∇ψ| ≤ 1 everywhere the steepest potential falls by the distance, straight or across."""
    angle = 2.0 * math.pi * np.arange(48) / 48
    costs = np.broadcast_to(np.ones_like(angle), (30, 40, 2, 48)).copy()
    cell = (0.5, 0.25)
    ends = [weights_at(p, (0.0, 0.0), cell, (31, 41)) for p in ((2.0, 1.0), (17.0, 6.0))]
    found = []

    def more(psi: np.ndarray) -> bool:
        top, bottom = (sum(w * psi[n] for n, w in zip(*e, strict=True)) for e in ends)
        found.append(levelled(psi, costs, cell, top, bottom))
        return len(found) < 15

    steepest_potential(costs, np.zeros((31, 41)), cell, *ends, more=more)
    distance = math.hypot(15.0, 5.0)
    # 48 directions let a slope exceed 1 by a part in 470 between two of them.
    assert 0.99 * distance < max(found) <= 1.0022 * distance


def test_a_wall_lengthens_the_potential() -> None:
    """Where the straight way is shut, the potential falls by the way round."""
    costs = np.ones((40, 40, 2, 48))
    costs[5:40, 20] = np.inf
    ends = [weights_at(p, (0.0, 0.0), (1.0, 1.0), (41, 41)) for p in ((10.0, 20.0), (31.0, 20.0))]
    found = []

    def more(psi: np.ndarray) -> bool:
        top, bottom = (sum(w * psi[n] for n, w in zip(*e, strict=True)) for e in ends)
        found.append(levelled(psi, costs, (1.0, 1.0), top, bottom))
        return len(found) < 40

    steepest_potential(costs, np.zeros((41, 41)), (1.0, 1.0), *ends, more=more)
    round_it = math.hypot(10.0, 15.0) + 1.0 + math.hypot(10.0, 15.0)
    assert 0.97 * round_it < max(found) <= 1.0022 * round_it
