"""The path whose largest value is least, against a plain search by thresholds."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.situation.bottleneck import bottleneck


def reached(open_nodes: np.ndarray, start: tuple[int, int]) -> set[tuple[int, int]]:
    """Nodes joined to the start by steps to any of eight neighbours."""
    found, waiting = {start}, [start]
    while waiting:
        j, i = waiting.pop()
        for b, a in ((j + dj, i + di) for dj in (-1, 0, 1) for di in (-1, 0, 1)):
            inside = 0 <= b < open_nodes.shape[0] and 0 <= a < open_nodes.shape[1]
            if inside and open_nodes[b, a] and (b, a) not in found:
                found.add((b, a))
                waiting.append((b, a))
    return found


@pytest.mark.parametrize("seed", range(6))
def test_the_level_is_the_least_that_joins(seed):
    values = np.random.default_rng(seed).integers(0, 50, (12, 17)).astype(float)
    values[values > 45] = np.inf
    start, goal = (0, 0), (11, 16)
    values[start] = values[goal] = 0.0
    level, place = bottleneck(values, start, goal)
    assert goal in reached(values <= level, start)
    assert goal not in reached(values < level, start)
    assert values[place] == level


def test_nothing_joins_what_a_wall_parts():
    values = np.zeros((6, 9))
    values[:, 4] = np.inf
    assert bottleneck(values, (2, 1), (2, 7)) is None
