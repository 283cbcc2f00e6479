"""The surface that a footprint feels: creases become ramps of slope, planes stay planes."""

from __future__ import annotations

import numpy as np
import pytest

from planner.terrain import Terrain
from planner.terrain.surface import footprint_heights, footprint_kernel

HALF_LENGTH = 0.6


def crease(direction: float, cell: float = 0.05, n: int = 121) -> Terrain:
    """Flat ground that rises at slope 1/5 beyond a line through (0, 0), along `direction`."""
    axis = (np.arange(n) - n // 2) * cell
    x, y = np.meshgrid(axis, axis)
    s = x * np.cos(direction) + y * np.sin(direction)
    return Terrain.from_arrays(
        0.2 * np.maximum(s, 0.0), cell=(cell, cell), origin=(axis[0], axis[0])
    )


@pytest.mark.parametrize("direction", np.radians([0.0, 30.0, 45.0, 90.0]))
def test_crease_is_felt_as_a_linear_ramp_of_slope(direction: float) -> None:
    terrain = crease(direction)
    ridden = Terrain.from_arrays(
        terrain.riding_surface(HALF_LENGTH), cell=terrain.cell, origin=terrain.origin
    )
    s = np.linspace(-1.2, 1.2, 97)
    gx, gy = ridden.gradient(s * np.cos(direction), s * np.sin(direction))
    along = gx * np.cos(direction) + gy * np.sin(direction)
    # (front - rear) / 2l of the unsmoothed crease: from 0 at s = -l to 0.2 at s = +l.
    felt = 0.2 * np.clip((s + HALF_LENGTH) / (2 * HALF_LENGTH), 0.0, 1.0)
    # A cell is 1/24 of the ramp: its corners are rounded by that much of 0.2.
    np.testing.assert_allclose(along, felt, atol=0.2 / 48)
    across = -gx * np.sin(direction) + gy * np.cos(direction)
    np.testing.assert_allclose(across, 0.0, atol=0.2 / 48)


@pytest.mark.parametrize("cell", [(0.1, 0.1), (0.05, 0.2), (0.25, 0.25)])
def test_kernel_projects_on_a_box_in_both_axes(cell: tuple[float, float]) -> None:
    # Archimedes: the share of a cell is its overlap with [-l, l], over 2l.
    kernel = footprint_kernel(half_length=HALF_LENGTH, cell=cell)
    assert kernel.sum() == pytest.approx(1.0, abs=1e-12)
    for axis, size in ((0, cell[0]), (1, cell[1])):
        projected = kernel.sum(axis=axis)
        centre = (np.arange(projected.size) - projected.size // 2) * size
        low = np.maximum(centre - size / 2, -HALF_LENGTH)
        high = np.minimum(centre + size / 2, HALF_LENGTH)
        np.testing.assert_allclose(projected, (high - low) / (2 * HALF_LENGTH), atol=2e-5)
    np.testing.assert_array_equal(kernel, kernel[::-1, ::-1])


def test_plane_comes_back_unchanged_up_to_the_border() -> None:
    x, y = np.meshgrid(np.arange(40) * 0.1, np.arange(30) * 0.2)
    plane = 1500.0 + 0.1 * x - 0.2 * y
    np.testing.assert_allclose(
        footprint_heights(plane, half_length=HALF_LENGTH, cell=(0.1, 0.2)), plane, atol=1e-11
    )


def test_mean_height_is_kept() -> None:
    hill = np.zeros((60, 60))
    hill[25:35, 20:40] = np.random.default_rng(2).uniform(0, 1, (10, 20))
    smooth = footprint_heights(hill, half_length=0.7, cell=(0.1, 0.1))
    assert smooth.mean() == pytest.approx(hill.mean(), rel=1e-12)
    assert smooth.max() < hill.max()


def test_footprint_within_a_cell_changes_nothing() -> None:
    z = np.random.default_rng(4).normal(size=(9, 9))
    same = footprint_heights(z, half_length=0.49, cell=(1.0, 1.0))
    np.testing.assert_array_equal(same, z)
    assert same is not z


def test_direct_sum_and_transform_agree() -> None:
    # 0.013 m cells make a kernel of 93 x 93, summed by transform; the direct sum is the definition.
    z = np.random.default_rng(9).normal(size=(120, 130)) + 300.0
    cell = (0.013, 0.013)
    kernel = footprint_kernel(half_length=HALF_LENGTH, cell=cell)
    smooth = footprint_heights(z, half_length=HALF_LENGTH, cell=cell)
    reach = kernel.shape[0] // 2
    for j, i in ((60, 65), (50, 80)):
        window = z[j - reach : j + reach + 1, i - reach : i + reach + 1]
        assert smooth[j, i] == pytest.approx(float((window * kernel).sum()), abs=1e-9)
