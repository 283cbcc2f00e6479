"""A mesh of several cells in one loses no slope or open ground of the map."""

from __future__ import annotations

import numpy as np
import pytest

from planner.search.certificate.mesh import coarse_field, mesh_of, slope_ranges
from planner.terrain.interpolation import interpolate_many
from tests.search.certificate.robots import field_of, model_of
from tests.search.maps import hills, terrain

STEEP = 0.3


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_slopes_of_the_map_are_in_the_ranges_of_the_mesh(parts: int) -> None:
    field, _ = field_of(terrain(hills(30, rms_degrees=8.0)), model_of("minibalance"))
    mesh = mesh_of(field, STEEP, parts)
    x, y = np.random.default_rng(4).uniform(0.0, 29 * 0.25, (2, 3000))
    surface = interpolate_many(field.heights, field.x0, field.y0, field.dx, field.dy, x, y)
    column = np.floor((x - mesh.origin[0]) / mesh.cell[0]).astype(int)
    row = np.floor((y - mesh.origin[1]) / mesh.cell[1]).astype(int)
    ranges = mesh.ranges[row, column]
    for value, low, high in zip(surface[1:], (0, 2), (1, 3), strict=True):
        assert (value >= ranges[:, low] - 1e-12).all()
        assert (value <= ranges[:, high] + 1e-12).all()


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_nodes_stand_where_the_map_has_that_height(parts: int) -> None:
    field, _ = field_of(terrain(hills(30)), model_of("minibalance"))
    mesh = mesh_of(field, STEEP, parts)
    coarse = coarse_field(field, mesh)
    assert coarse.heights.shape == mesh.heights.shape
    ny, nx = mesh.heights.shape
    i = np.rint((mesh.origin[0] + mesh.cell[0] * np.arange(nx) - field.x0) / field.dx).astype(int)
    j = np.rint((mesh.origin[1] + mesh.cell[1] * np.arange(ny) - field.y0) / field.dy).astype(int)
    rows, columns = np.flatnonzero((j >= 0) & (j < 30)), np.flatnonzero((i >= 0) & (i < 30))
    on_map = field.heights[np.ix_(j[rows], i[columns])]
    np.testing.assert_array_equal(mesh.heights[np.ix_(rows, columns)], on_map)
    np.testing.assert_array_equal(coarse.heights[np.ix_(rows, columns)], on_map)


def test_a_coarse_triangle_is_a_wall_only_where_all_of_it_is() -> None:
    """A block of obstacles wider than the robot: walls inside it, none on open ground."""
    blocked = np.zeros((40, 40), bool)
    blocked[10:30, 10:30] = True
    field, _ = field_of(terrain(np.zeros((40, 40)), obstacles=blocked), model_of("minibalance"))
    fine, coarse = (mesh_of(field, STEEP, parts).wall for parts in (1, 3))
    assert fine[20, 20].all()
    assert not fine[:8].any()
    assert coarse.any()
    for row, column in np.argwhere(coarse[..., 0]):
        assert fine[3 * row : 3 * row + 3, 3 * column : 3 * column + 3].all()


def test_slopes_of_a_cell_stay_in_their_range() -> None:
    """Bernstein coefficients against the surface itself, at random points of rough ground."""
    rng = np.random.default_rng(8)
    heights = rng.normal(0.0, 0.3, (12, 14))
    ranges = slope_ranges(heights, 0.5, 0.7)
    x, y = rng.uniform(1.0, 12.0, 4000), rng.uniform(1.0, 10.0, 4000)
    _, px, py = interpolate_many(heights, 0.0, 0.0, 0.5, 0.7, 0.5 * x, 0.7 * y)
    cell = ranges[np.floor(y).astype(int) - 1, np.floor(x).astype(int) - 1]
    for value, low, high in ((px, 0, 1), (py, 2, 3)):
        assert (value >= cell[:, low] - 1e-12).all()
        assert (value <= cell[:, high] + 1e-12).all()
