"""The surface that a footprint feels: creases become ramps of slope, planes stay planes."""

from __future__ import annotations

import numpy as np
import pytest

from planner.terrain.heightmap import Terrain
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


@pytest.mark.parametrize("cell", [(0.1, 0.1), (0.05, 0.2), (0.25, 0.25), (0.5, 2.0)])
def test_kernel_projects_on_a_box_of_interpolated_heights(cell: tuple[float, float]) -> None:
    # Archimedes: in each axis a node's share is the mean over [-l, l] of its cubic.
    kernel = footprint_kernel(half_length=HALF_LENGTH, cell=cell)
    assert kernel.sum() == pytest.approx(1.0, abs=1e-12)
    for axis, size in ((0, cell[0]), (1, cell[1])):
        projected = kernel.sum(axis=axis)
        node = np.arange(projected.size) - projected.size // 2
        # The middles of many pieces; the cubic of a node is that of a single height of 1.
        x = HALF_LENGTH * (2.0 * np.arange(4000) + 1.0 - 4000.0) / 4000.0
        s = np.abs(x / size - node[:, None])
        near, far = 1.5 * s**3 - 2.5 * s**2 + 1.0, -0.5 * s**3 + 2.5 * s**2 - 4.0 * s + 2.0
        cubic = np.where(s < 1.0, near, np.where(s < 2.0, far, 0.0))
        np.testing.assert_allclose(projected, cubic.mean(axis=1), atol=2e-5)
        # The cubic reproduces quadratics: the footprint's own second moment.
        moment = float(projected @ (node * size) ** 2)
        assert moment == pytest.approx(HALF_LENGTH**2 / 3.0, rel=1e-9)
    np.testing.assert_allclose(kernel, kernel[::-1, ::-1], atol=1e-15)


@pytest.mark.parametrize("cell", [0.3, 0.5, 1.0])
def test_finer_nodes_of_the_same_surface_feel_the_same(cell: float) -> None:
    """Cells as large as the footprint and larger: what lies between the nodes is averaged, too."""
    half_length, parts = 0.23, round(cell / 0.025)
    z = np.random.default_rng(1).normal(scale=0.03, size=(24, 24))
    rough = Terrain.from_arrays(z, cell=(cell, cell))
    axis = cell / parts * np.arange(23 * parts + 1)
    fine = Terrain.from_arrays(
        rough.height(*np.meshgrid(axis, axis)), cell=(cell / parts, cell / parts)
    )
    felt, closely = (one.riding_surface(half_length) for one in (rough, fine))
    inner = slice(3, -3)
    np.testing.assert_allclose(
        felt[inner, inner], closely[::parts, ::parts][inner, inner], atol=2e-5
    )
    place = np.random.default_rng(2).uniform(3.0 * cell, 20.0 * cell, (2, 4000))
    slopes = [
        np.hypot(*Terrain.from_arrays(heights, cell=one.cell).gradient(*place)).mean()
        for heights, one in ((felt, rough), (closely, fine))
    ]
    # Of the roughest ground that nodes can hold the cubic between coarse ones takes a part; without
    # an average, 36 % too much is left at 0.5 m.
    assert slopes[0] == pytest.approx(slopes[1], rel=0.15)


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
