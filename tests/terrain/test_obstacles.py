"""Blocked cells and the body's rectangle among them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from planner.terrain.heightmap import Terrain
from planner.terrain.obstacles import clear_of, rectangle_free, rim_near, yaw_mask

LONG, WIDE = 0.43, 0.26


def drawn(*rows: str) -> NDArray[np.bool_]:
    """A blocked grid from a drawing, '#' = blocked, the NORTH row first."""
    return np.array([[character == "#" for character in row] for row in rows])[::-1].copy()


def test_obstacles_holes_and_both_sides_of_a_ledge_are_blocked() -> None:
    z = np.zeros((6, 8))
    z[:, 5:] = 0.6  # a dock edge between columns 4 and 5, cells of 0.1 m: steeper than 45 degrees
    known = np.ones((6, 8), bool)
    known[0, 0] = False
    obstacles = np.zeros((6, 8), bool)
    obstacles[3, 1] = True
    terrain = Terrain.from_arrays(z, cell=(0.1, 0.1), known=known, obstacles=obstacles)
    blocked = terrain.blocked_cells(0.03)
    expected = obstacles | ~known
    expected[:, 4:6] = True
    np.testing.assert_array_equal(blocked, expected)
    assert terrain.why_blocked(0.03, 3, 1) == "obstacle"
    assert terrain.why_blocked(0.03, 0, 0) == "hole"
    assert terrain.why_blocked(0.03, 2, 4) == "ledge"
    assert terrain.why_blocked(0.03, 2, 5) == "ledge"
    assert terrain.why_blocked(0.03, 2, 3) is None
    assert terrain.why_blocked(0.03, -1, 3) == "edge of the map"
    assert terrain.why_blocked(0.03, 0, 8) == "edge of the map"


def test_a_step_is_a_ledge_only_when_both_high_and_steep() -> None:
    z = np.zeros((5, 6))
    z[:, 3:] = 0.05
    fine = Terrain.from_arrays(z, cell=(0.04, 0.04))
    assert fine.blocked_cells(0.03).any()
    assert not fine.blocked_cells(0.06).any()  # low enough to ride over
    coarse = Terrain.from_arrays(z, cell=(0.06, 0.06))
    assert not coarse.blocked_cells(0.03).any()  # 40 degrees: a slope, for the power model
    along_y = Terrain.from_arrays(z.T[:6, :5], cell=(10.0, 0.04))
    assert along_y.blocked_cells(0.03).sum() == 10


def test_the_rim_of_a_hole_is_not_a_ledge() -> None:
    z = np.tile([0.0, 0.0, 0.0, np.nan, 5.0, 5.0, 5.0], (5, 1))
    terrain = Terrain.from_arrays(z, cell=(0.1, 0.1))
    np.testing.assert_array_equal(terrain.blocked_cells(0.03), ~terrain.known)


def test_reasons_agree_with_the_mask_everywhere() -> None:
    rng = np.random.default_rng(0)
    terrain = Terrain.from_arrays(
        rng.normal(scale=0.2, size=(20, 25)),
        cell=(0.3, 0.2),
        known=rng.random((20, 25)) > 0.1,
        obstacles=rng.random((20, 25)) < 0.1,
    )
    blocked = terrain.blocked_cells(0.1)
    reasons = [[terrain.why_blocked(0.1, j, i) is not None for i in range(25)] for j in range(20)]
    np.testing.assert_array_equal(blocked, reasons)


def free_by_points(
    blocked: NDArray[np.bool_], cell: tuple[float, float], pose: tuple[float, ...], shrink: float
) -> bool:
    """Brute force: no point of the rectangle, made smaller by `shrink`, lies on a blocked cell."""
    x, y, yaw, half_length, half_width = pose
    a, b = np.meshgrid(
        np.linspace(-1, 1, 121) * (half_length - shrink),
        np.linspace(-1, 1, 81) * (half_width - shrink),
    )
    px = x + a * np.cos(yaw) - b * np.sin(yaw)
    py = y + a * np.sin(yaw) + b * np.cos(yaw)
    i = np.floor(px / cell[0] + 0.5).astype(int)
    j = np.floor(py / cell[1] + 0.5).astype(int)
    ny, nx = blocked.shape
    inside = (i >= 0) & (i < nx) & (j >= 0) & (j < ny)
    return bool(inside.all() and not blocked[j, i].any())


def test_rectangle_agrees_with_points_in_it() -> None:
    rng = np.random.default_rng(42)
    cell = (0.13, 0.21)
    answers = []
    for _ in range(400):
        blocked = rng.random((14, 20)) < 0.04
        pose = (
            rng.uniform(-0.1, 2.6),
            rng.uniform(-0.1, 2.9),
            rng.uniform(-7, 7),
            rng.uniform(0.1, 0.5),
            rng.uniform(0.1, 0.5),
        )
        free = rectangle_free(blocked, 0.0, 0.0, *cell, *pose)
        # Points lie up to 1/120 of the sides apart: only a corner thinner than that slips through.
        if free:
            assert free_by_points(blocked, cell, pose, 1e-5)
        else:
            assert not free_by_points(blocked, cell, pose, -0.012)
        answers.append(free)
    assert 50 < sum(answers) < 350


def test_a_free_place_meets_the_rim_of_a_region_first() -> None:
    rng = np.random.default_rng(7)
    cell, body = (0.13, 0.21), (0.5, 0.3)
    reach, found, fewer = float(np.hypot(*body)), 0, 0
    for _ in range(300):
        blocked = np.zeros((24, 30), bool)
        for _ in range(4):
            i, j = rng.integers(0, 30), rng.integers(0, 24)
            blocked[j : j + rng.integers(1, 7), i : i + rng.integers(1, 7)] = True
        x, y = rng.uniform(0.8, 3.0), rng.uniform(0.8, 4.0)
        if blocked[round(y / cell[1]), round(x / cell[0])]:
            continue
        cells = np.empty((400, 2))
        count = rim_near(blocked, (0.0, 0.0, *cell), x, y, reach, cells)
        for yaw in rng.uniform(-4.0, 4.0, 8):
            clear = clear_of(cells[:count], (0.5 * cell[0], 0.5 * cell[1]), yaw, body)
            assert clear == rectangle_free(blocked, 0.0, 0.0, *cell, x, y, yaw, *body)
            found += not clear
        fewer += count < blocked.sum()
    assert found > 300
    assert fewer > 100


def test_rectangle_beyond_the_border_or_not_a_number_is_not_free() -> None:
    blocked = np.zeros((10, 10), bool)
    # Cells of 0.2 m from -0.1 to 1.9: a half length of 0.5 fits at 0.4, not at 0.399.
    assert rectangle_free(blocked, 0.0, 0.0, 0.2, 0.2, 0.4, 0.9, 0.0, 0.5, 0.2)
    assert not rectangle_free(blocked, 0.0, 0.0, 0.2, 0.2, 0.399, 0.9, 0.0, 0.5, 0.2)
    assert rectangle_free(blocked, 0.0, 0.0, 0.2, 0.2, 0.399, 0.9, np.pi / 2, 0.5, 0.2)
    for pose in ((np.nan, 0.9, 0.0), (0.9, np.inf, 0.0), (0.9, 0.9, np.nan)):
        assert not rectangle_free(blocked, 0.0, 0.0, 0.2, 0.2, *pose, 0.5, 0.2)


def test_contact_is_free_and_a_hundredth_of_a_millimetre_is_not() -> None:
    blocked = drawn(".....", ".....", "....#", ".....", ".....")
    # The blocked square spans x = 3.5 .. 4.5; a rectangle at x = 2 reaches it with half length 1.5.
    assert rectangle_free(blocked, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 0.0, 1.5, 0.3)
    assert not rectangle_free(blocked, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 0.0, 1.50001, 0.3)
    # Turned by 45 degrees its corner reaches sqrt(2) * 1.06 = 1.499 < 1.5.
    assert rectangle_free(blocked, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, np.pi / 4, 1.06, 1.06)
    assert not rectangle_free(blocked, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, np.pi / 4, 1.07, 1.07)


@pytest.mark.parametrize("share", [0.02, 0.5])
@pytest.mark.parametrize("n_bins", [1, 16, 64])
def test_yaw_mask_agrees_with_the_rectangle_at_every_cell_and_bin(
    share: float, n_bins: int
) -> None:
    blocked = np.random.default_rng(n_bins).random((24, 31)) < share
    dx, dy = 0.11, 0.17
    mask = yaw_mask(blocked, dx, dy, LONG, WIDE, n_bins)
    for j in range(24):
        for i in range(31):
            for k in range(n_bins):
                free = rectangle_free(
                    # A frame as far away as UTM's, where x and y carry fewer digits.
                    blocked,
                    5e5,
                    4e6,
                    dx,
                    dy,
                    5e5 + i * dx,
                    4e6 + j * dy,
                    k * np.pi / n_bins,
                    LONG,
                    WIDE,
                )
                assert free == bool(int(mask[j, i]) >> k & 1), (j, i, k)


def test_yaw_mask_far_from_everything_has_all_bits_and_refuses_65_bins() -> None:
    blocked = np.zeros((60, 60), bool)
    assert yaw_mask(blocked, 0.1, 0.1, LONG, WIDE, 64)[30, 30] == np.uint64(2**64 - 1)
    assert yaw_mask(blocked, 0.1, 0.1, LONG, WIDE, 5)[30, 30] == np.uint64(31)
    assert yaw_mask(blocked, 0.1, 0.1, LONG, WIDE, 64)[0, 0] == 0
    with pytest.raises(ValueError, match="n_bins"):
        yaw_mask(blocked, 0.1, 0.1, LONG, WIDE, 65)


def test_a_passage_narrower_than_long_is_passed_lengthwise_only() -> None:
    # Two walls, 0.7 m apart, along x: wider than the robot is wide, narrower than it is long.
    blocked = np.zeros((31, 60), bool)
    blocked[:12, 20:40] = True
    blocked[19:, 20:40] = True
    mask = yaw_mask(blocked, 0.1, 0.1, LONG, WIDE, 32)
    through = mask[15, 20:40]
    assert all(int(bits) & 1 for bits in through), "lengthwise, along x"
    assert not any(int(bits) >> 16 & 1 for bits in through), "sideways"
    # A turn by d needs 2 (0.43 sin d + 0.26 cos d) < 0.7 m: 12.5 degrees, two bins of 5.6.
    free = {k for k in range(32) if int(through[10]) >> k & 1}
    assert free == {0, 1, 2, 30, 31}


def test_mask_of_a_turned_map_is_the_turned_mask() -> None:
    blocked = np.random.default_rng(8).random((30, 40)) < 0.03
    n = 16
    mask = yaw_mask(blocked, 0.1, 0.15, LONG, WIDE, n)
    turned = yaw_mask(np.rot90(blocked, -1).copy(), 0.15, 0.1, LONG, WIDE, n)
    # A quarter turn moves yaw bin k to k + n / 2.
    back = np.rot90(turned, 1)
    shifted = (back >> np.uint64(n // 2)) | (back << np.uint64(n // 2)) & np.uint64(2**n - 1)
    np.testing.assert_array_equal(shifted, mask)
