"""Clusters of rows against products of the rows themselves."""

from __future__ import annotations

import numpy as np
import pytest

from planner.telemetry.evidence.gram_matrices import RowClusters

random = np.random.default_rng(8)
ROWS = random.standard_normal((60, 6))
NUMBERS = np.repeat(np.arange(4), [10, 25, 5, 20])
RUNS = np.repeat(np.arange(2), [35, 25])
PARTS = [ROWS[number == NUMBERS] for number in range(4)]
AT, OWN = np.array([4, 2]), np.array([0, 1, 5])
LEAN = random.standard_normal((3, 2))


@pytest.fixture
def clusters() -> RowClusters:
    return RowClusters(ROWS, NUMBERS, RUNS)


def test_sums_over_blocks(clusters: RowClusters) -> None:
    np.testing.assert_array_equal(clusters.runs, [0, 0, 1, 1])
    np.testing.assert_allclose(clusters.total(), ROWS.T @ ROWS)
    some = np.vstack([PARTS[1], PARTS[3]])
    np.testing.assert_allclose(clusters.part(np.array([3, 1])), some.T @ some)


def test_products_with_a_vector(clusters: RowClusters) -> None:
    v = np.arange(6.0)
    np.testing.assert_allclose(clusters.times(v), [part.T @ (part @ v) for part in PARTS])


def test_what_is_left_of_columns(clusters: RowClusters) -> None:
    left = [part[:, AT] - part[:, OWN] @ LEAN for part in PARTS]
    np.testing.assert_allclose(
        clusters.partial_grams(AT, OWN, LEAN), [part.T @ part for part in left]
    )
    np.testing.assert_allclose(
        clusters.partial_diagonals(AT, OWN, LEAN), [(part**2).sum(axis=0) for part in left]
    )
