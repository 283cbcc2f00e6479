"""The least that must be passed between two places: the widest gap, the gentlest crossing.

level, place = bottleneck(values, start, goal)

Of all paths over the nodes, the one whose largest value is least: thresholds are bisected and the
nodes below each are grouped (the minimax path, without a search).
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from planner.arrays import Array

Node = tuple[int, int]
DIAGONALS = np.ones((3, 3), bool)


def bottleneck(values: Array, start: Node, goal: Node) -> tuple[float, Node] | None:
    """The least possible largest value on a path, and where it stands; None without a path.

    Args:
        values: (ny, nx), infinite where no path leads.
        start, goal: rows and columns; their own values count as the least.
    """
    values = values.copy()
    values[start] = values[goal] = values.min()
    levels = np.unique(values[np.isfinite(values)])
    low, high = -1, len(levels) - 1
    if not _joined(values, levels[high], start, goal):
        return None
    while high - low > 1:
        middle = (low + high) // 2
        if _joined(values, levels[middle], start, goal):
            high = middle
        else:
            low = middle
    if low < 0:
        return float(levels[0]), start
    # What the highest level adds between the two groups that the level below leaves apart.
    groups, _ = ndimage.label(values <= levels[low], DIAGONALS)
    away = [ndimage.distance_transform_edt(groups != groups[node]) for node in (start, goal)]
    added = values == levels[high]
    apart = np.where(added, away[0] + away[1], np.inf)
    j, i = np.unravel_index(int(np.argmin(apart)), apart.shape)
    return float(levels[high]), (int(j), int(i))


def _joined(values: Array, level: float, start: Node, goal: Node) -> bool:
    groups, _ = ndimage.label(values <= level, DIAGONALS)
    return bool(groups[start] == groups[goal] != 0)
