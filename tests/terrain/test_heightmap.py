"""Heights and their gradient: one function and its exact derivative."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from planner.errors import MapError
from planner.terrain.heightmap import Terrain
from planner.terrain.interpolation import interpolate
from planner.terrain.surface import GroundClass

CELL = (0.5, 0.2)
ORIGIN = (3.0, -1.0)


def rough_ground() -> Terrain:
    heights = np.random.default_rng(7).normal(size=(11, 9))
    return Terrain.from_arrays(heights, cell=CELL, origin=ORIGIN)


def sampled(formula: object, shape: tuple[int, int] = (11, 9)) -> Terrain:
    """A terrain whose nodes are values of formula(x, y)."""
    x, y = np.meshgrid(
        ORIGIN[0] + CELL[0] * np.arange(shape[1]), ORIGIN[1] + CELL[1] * np.arange(shape[0])
    )
    return Terrain.from_arrays(formula(x, y), cell=CELL, origin=ORIGIN)  # type: ignore[operator]


def points(terrain: Terrain, n: int, beyond: float = 0.0) -> tuple[NDArray[np.float64], ...]:
    xmin, ymin, xmax, ymax = terrain.extent
    draw = np.random.default_rng(3).uniform
    return draw(xmin - beyond, xmax + beyond, n), draw(ymin - beyond, ymax + beyond, n)


def test_surface_runs_through_the_nodes() -> None:
    terrain = rough_ground()
    x, y = np.meshgrid(ORIGIN[0] + CELL[0] * np.arange(9), ORIGIN[1] + CELL[1] * np.arange(11))
    np.testing.assert_allclose(terrain.height(x, y), terrain.heights, atol=1e-13)


def test_plane_is_exact_inside_at_the_border_and_beyond() -> None:
    # Different slopes on different cell sizes: swapped axes cannot pass.
    terrain = sampled(lambda x, y: 2.0 + 0.3 * x - 0.7 * y)
    x, y = points(terrain, 500, beyond=2.0)
    np.testing.assert_allclose(terrain.height(x, y), 2.0 + 0.3 * x - 0.7 * y, atol=1e-12)
    gx, gy = terrain.gradient(x, y)
    np.testing.assert_allclose(gx, 0.3, atol=1e-12)
    np.testing.assert_allclose(gy, -0.7, atol=1e-12)


def test_quadratic_is_exact_one_cell_off_the_border() -> None:
    # Keys 1981: the kernel's error is of third order, so a quadratic has none.
    terrain = sampled(lambda x, y: 0.2 * x * x - 0.5 * x * y + 0.9 * y * y)
    draw = np.random.default_rng(5).uniform
    x, y = draw(3.5, 6.5, 300), draw(-0.8, 0.8, 300)
    np.testing.assert_allclose(
        terrain.height(x, y), 0.2 * x * x - 0.5 * x * y + 0.9 * y * y, atol=1e-12
    )
    gx, gy = terrain.gradient(x, y)
    np.testing.assert_allclose(gx, 0.4 * x - 0.5 * y, atol=1e-11)
    np.testing.assert_allclose(gy, -0.5 * x + 1.8 * y, atol=1e-11)


def test_gradient_is_the_derivative_of_height() -> None:
    terrain = rough_ground()
    x, y = points(terrain, 500, beyond=1.0)
    step = 1e-6
    gx, gy = terrain.gradient(x, y)
    along_x = (terrain.height(x + step, y) - terrain.height(x - step, y)) / (2 * step)
    along_y = (terrain.height(x, y + step) - terrain.height(x, y - step)) / (2 * step)
    np.testing.assert_allclose(gx, along_x, atol=2e-7)
    np.testing.assert_allclose(gy, along_y, atol=2e-7)


@settings(max_examples=25)
@given(
    st.lists(st.tuples(st.floats(2.5, 7.5), st.floats(-1.4, 1.4)), min_size=3, max_size=5),
)
def test_slope_round_a_closed_path_adds_up_to_nothing(corners: list[tuple[float, float]]) -> None:
    terrain = rough_ground()
    nodes, weights = np.polynomial.legendre.leggauss(6)
    total = 0.0
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        # Cut at every grid line, where the cubic changes: between them Gauss is exact.
        cuts = {0.0, 1.0}
        for axis in (0, 1):
            change = end[axis] - start[axis]
            lines = ORIGIN[axis] + CELL[axis] * np.arange(-9, 21)
            if abs(change) > 1e-9:
                cuts |= {float(t) for t in (lines - start[axis]) / change if 0 < t < 1}
        edges = np.array(sorted(cuts))
        middle, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
        t = (middle[:, None] + half[:, None] * nodes).ravel()
        weight = (half[:, None] * weights).ravel()
        gx, gy = terrain.gradient(
            start[0] + t * (end[0] - start[0]), start[1] + t * (end[1] - start[1])
        )
        total += float(weight @ (gx * (end[0] - start[0]) + gy * (end[1] - start[1])))
    assert abs(total) < 1e-9


def test_gradient_is_continuous_across_grid_lines() -> None:
    terrain = rough_ground()
    x, y = ORIGIN[0] + 4 * CELL[0], ORIGIN[1] + 5.37 * CELL[1]
    before, after = terrain.gradient(x - 1e-9, y), terrain.gradient(x + 1e-9, y)
    np.testing.assert_allclose(before, after, atol=1e-6)


def test_mirrored_and_turned_ground_gives_mirrored_and_turned_slopes() -> None:
    z = np.random.default_rng(11).normal(size=(8, 8))
    plain = Terrain.from_arrays(z, cell=(1.0, 1.0), origin=(-3.5, -3.5))
    turned = Terrain.from_arrays(np.rot90(z, -1), cell=(1.0, 1.0), origin=(-3.5, -3.5))
    # rot90 by -1 turns the printed array clockwise; with row 0 in the south that is a turn to the
    # left, (x, y) -> (-y, x).
    x, y = np.random.default_rng(1).uniform(-3, 3, (2, 50))
    np.testing.assert_allclose(turned.height(-y, x), plain.height(x, y), atol=1e-12)
    gx, gy = plain.gradient(x, y)
    hx, hy = turned.gradient(-y, x)
    np.testing.assert_allclose(hx, -gy, atol=1e-12)
    np.testing.assert_allclose(hy, gx, atol=1e-12)


def test_compiled_kernel_and_method_agree_and_nan_stays_nan() -> None:
    terrain = rough_ground()
    z, gx, gy = interpolate(terrain.heights, *ORIGIN, *CELL, 4.33, 0.11)
    assert z == terrain.height(4.33, 0.11)
    assert (gx, gy) == terrain.gradient(4.33, 0.11)
    assert all(np.isnan(interpolate(terrain.heights, *ORIGIN, *CELL, np.nan, 0.0)))
    assert all(np.isnan(interpolate(terrain.heights, *ORIGIN, *CELL, 0.0, np.inf)))


def test_holes_are_not_known_and_carry_the_nearest_known_height() -> None:
    z = np.tile(np.arange(6.0), (6, 1))
    z[2, 3] = np.nan
    # Cells are three times as long in x: the nearest known cell lies in y, of the same height.
    terrain = Terrain.from_arrays(z, cell=(3.0, 1.0))
    assert not terrain.known[2, 3]
    assert terrain.known.sum() == 35
    assert terrain.heights[2, 3] == 3.0
    assert np.isfinite(terrain.height(np.linspace(0, 15, 40), 2.2)).all()


def test_extent_and_cells() -> None:
    terrain = rough_ground()
    assert terrain.extent == pytest.approx((2.75, -1.1, 7.25, 1.1))
    assert terrain.contains(2.76, 1.09)
    assert not terrain.contains(2.74, 0.0)
    assert not terrain.contains(float("nan"), 0.0)
    assert terrain.cell_index(3.26, -0.71) == (1, 1)
    assert terrain.cell_index(0.0, 0.0) == (5, -6)


def test_fingerprint_knows_the_ground_but_not_the_name() -> None:
    z = np.arange(20.0).reshape(4, 5)
    first = Terrain.from_arrays(z, cell=(1, 1), name="first")
    assert first.fingerprint == Terrain.from_arrays(z, cell=(1, 1), name="second").fingerprint
    others = [
        Terrain.from_arrays(z, cell=(1, 1.5)),
        Terrain.from_arrays(z, cell=(1, 1), origin=(0, 1)),
        Terrain.from_arrays(z, cell=(1, 1), obstacles=z > 18),
        Terrain.from_arrays(z, cell=(1, 1), known=z > 0),
        Terrain.from_arrays(z, cell=(1, 1), ground_classes=(GroundClass("mud", rolling=2.0),)),
    ]
    assert len({first.fingerprint, *(other.fingerprint for other in others)}) == 6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"heights": np.zeros((3, 8))}, "at least 4 by 4"),
        ({"heights": np.zeros(9)}, "two dimensions"),
        ({"heights": np.full((5, 5), np.nan)}, "no known height"),
        ({"cell": (0.0, 1.0)}, "both above 0"),
        ({"cell": (1.0, float("inf"))}, "both above 0"),
        ({"origin": (0.0, float("nan"))}, "both finite"),
        ({"obstacles": np.zeros((4, 5), bool)}, "the shape of its heights"),
        ({"ground": np.full((5, 5), 1)}, "indices below 1"),
        ({"ground": np.full((5, 5), -1)}, "whole numbers"),
        ({"ground_classes": (GroundClass("ice", traction=0.0),)}, "traction above 0"),
    ],
)
def test_impossible_arrays_are_refused(change: dict[str, object], words: str) -> None:
    arrays: dict[str, object] = {"heights": np.zeros((5, 5)), "cell": (1.0, 1.0)} | change
    heights = arrays.pop("heights")
    with pytest.raises(MapError, match=words):
        Terrain.from_arrays(heights, **arrays)  # type: ignore[arg-type]
