"""What moves on the grid cost, against the straight lines between their nodes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.search.field import segment_cost
from planner.search.grid import cost_to_go
from planner.search.grid.close_moves import FROM_BORDER, close_cost, node_slope
from planner.search.grid.lattice import PRICED_CLOSELY, build_lattice
from planner.search.resolution import MOVES, OBJECTIVES
from tests.search.certificate.robots import windy
from tests.search.grid.test_least_cost import CELL, field_of, hills, move_cost, situation_on

SOUTH_EAST = (0.06, -0.09)


@pytest.fixture(scope="module")
def inclined():
    """A plane that rises to the south-east, and its moves."""
    x = CELL * np.arange(40)
    field = field_of(SOUTH_EAST[0] * x[None, :] + SOUTH_EAST[1] * x[:, None])
    return field, build_lattice(field)


def line(field, j: int, i: int, di: int, dj: int) -> float:
    """Cost of the straight line from node (j, i) to the one by (di, dj) from it."""
    x, y = field.x0 + i * field.dx, field.y0 + j * field.dy
    return segment_cost(field, x, y, x + di * field.dx, y + dj * field.dy, field.step)


def test_moves_on_a_plane_cost_their_lines(inclined):
    field, lattice = inclined
    assert lattice.slopes[20, 20] != PRICED_CLOSELY
    for m, (di, dj) in enumerate(MOVES):
        expected = line(field, 20, 20, int(di), int(dj))
        assert move_cost(field, lattice, 20, 20, m) == pytest.approx(expected, rel=5e-3)
        assert close_cost(field, 20, 20, int(di), int(dj)) == pytest.approx(expected, rel=5e-3)


def test_no_move_undercuts_the_cheapest_metre():
    field = field_of(hills())
    lattice = build_lattice(field)
    lengths = np.hypot(MOVES[:, 0], MOVES[:, 1]) * CELL
    for j, i in np.random.default_rng(4).integers(4, 36, (40, 2)):
        costs = [move_cost(field, lattice, j, i, m) for m in range(len(MOVES))]
        assert (np.array(costs) >= lattice.cheapest * lengths * (1.0 - 1e-6)).all()


def test_the_slope_of_a_node_is_that_of_its_plane(inclined):
    field, _ = inclined
    for j, i in ((20, 20), (5, 30), (33, 7)):
        assert node_slope(field, j, i) == pytest.approx(SOUTH_EAST, rel=1e-6)


def test_moves_into_a_wall_cost_infinity():
    obstacles = np.zeros((40, 40), bool)
    obstacles[20, :] = True
    field = field_of(np.zeros((40, 40)), obstacles)
    lattice = build_lattice(field)
    # Cells may have been divided.
    south = int(np.flatnonzero(field.blocked.any(axis=1))[0]) - 1
    middle = field.heights.shape[1] // 2
    assert lattice.slopes[south, middle] == PRICED_CLOSELY
    assert close_cost(field, south, middle, 0, 1) == math.inf
    assert lattice.slopes[south // 2, middle] != PRICED_CLOSELY
    assert math.isfinite(close_cost(field, south // 2, middle, 0, 1))


def test_processes_share_what_does_not_depend_on_the_map(tmp_path, monkeypatch):
    """A table is read where another map with the same cell has made it; other cells have theirs."""
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("JOULEPATH_KEEP_TABLES", raising=False)
    hilly, flat = field_of(hills()), field_of(np.zeros((40, 40)))
    wider = hilly._replace(dx=2.0 * hilly.dx)
    alone = build_lattice(hilly)
    made = build_lattice(hilly, key=("a robot",))
    assert np.array_equal(made.table, alone.table)
    assert made.cheapest == alone.cheapest
    (file,) = (tmp_path / "tables").iterdir()
    written = file.stat().st_ino
    read = build_lattice(flat._replace(safe=hilly.safe), key=("a robot",))
    assert np.array_equal(read.table, alone.table)
    assert read.cheapest == alone.cheapest
    assert not np.array_equal(read.slopes, alone.slopes)
    (file,) = (tmp_path / "tables").iterdir()
    assert file.stat().st_ino == written
    other = build_lattice(wider, key=("a robot",))
    assert np.array_equal(other.table, build_lattice(wider).table)
    assert not np.array_equal(other.table, alone.table)
    assert len([*(tmp_path / "tables").iterdir()]) == 2


@pytest.mark.parametrize("wind", [0.0, 3.0])
def test_one_look_at_steep_ground_prices_all_objectives(wind):
    """As the straight lines cost, also in wind, which adds to energy alone."""
    situation = situation_on(4.0 * hills(seed=3), model=windy(), wind={"x": wind})
    assert situation.field("energy").extra.any() == (wind > 0.0)
    assert not situation.field("time").extra.any()
    lattices = {}
    for aim in OBJECTIVES:
        field = situation.field(aim)
        lattices[aim] = situation.lattice(aim, field)
        cost_to_go(field, lattices[aim], (10.0, 10.0))
    for aim, lattice in lattices.items():
        field = situation.field(aim)
        rows, moves = np.nonzero(~np.isnan(lattice.close))
        j, i = np.nonzero(lattice.row >= 0)
        steep = 0
        for row, m in zip(rows[::7], moves[::7], strict=True):
            b, a, (di, dj) = j[row], i[row], (int(k) for k in MOVES[m])
            if field.steep[b, a]:
                steep += 1
                expected = line(field, b, a, di, dj)
                assert lattice.close[row, m] == pytest.approx(expected, rel=1e-6)
        assert steep > 100


def test_what_one_objective_priced_another_one_knows():
    """On steep ground; near the border each objective has prices of its own."""
    situation = situation_on(4.0 * hills(seed=4))
    lattices = {aim: situation.lattice(aim, situation.field(aim)) for aim in OBJECTIVES}
    field = situation.field("energy")
    cost_to_go(field, lattices["energy"], (10.0, 10.0))
    inner = np.zeros(field.steep.shape, bool)
    inner[FROM_BORDER:-FROM_BORDER, FROM_BORDER:-FROM_BORDER] = True
    rows = lattices["energy"].row[inner & field.steep]
    known = {aim: ~np.isnan(lattice.close[rows]) for aim, lattice in lattices.items()}
    assert known["energy"].sum() > 100
    assert np.array_equal(known["time"], known["energy"])
    assert np.array_equal(known["length"], known["energy"])


def test_room_for_prices_counts_for_as_long_as_a_lattice_has_it():
    """The cache may forget what objectives share, and still hold their lattices."""
    situation = situation_on(4.0 * hills(seed=3))
    lattices = [situation.lattice(aim, situation.field(aim)) for aim in OBJECTIVES]
    shared = lattices[0].together
    assert all(lattice.together is shared for lattice in lattices)
    assert sum(one.nbytes - one.table.nbytes for one in lattices) == shared.close.nbytes > 0
