"""The commands that list what is installed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.service.cli.command import expect_refusal, joulepath


@pytest.mark.parametrize("command", ["maps", "vehicles", "effects"])
def test_catalogues_are_lists_of_named_objects(command: str) -> None:
    done = joulepath(command, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    entries = json.loads(done.stdout, parse_constant=lambda name: pytest.fail(name))
    assert entries
    assert all(entry["name"] for entry in entries)
    names = [entry["name"] for entry in entries]
    assert len(set(names)) == len(names)
    table = joulepath(command)
    assert table.returncode == 0
    assert all(name in table.stdout for name in names)


@pytest.mark.parametrize(
    "asked",
    [
        *("maps", "effects", "vehicles", "vehicles new", "vehicles minibalance --toml"),
        *("--help", "plan --help"),
    ],
)
def test_what_needs_no_kernel_loads_no_compiler(asked: str) -> None:
    script = (
        "import sys; from service.cli import run\n"
        "heavy = {'numba', 'scipy', 'ompl', 'fastapi', 'rasterio', 'planner.search.requests'}\n"
        f"try: run({asked.split()!r})\n"
        "finally: sys.exit(bool(heavy & {*sys.modules}))"
    )
    assert subprocess.run([sys.executable, "-c", script], stdout=subprocess.DEVNULL).returncode == 0


def test_a_plane_is_as_steep_as_it_is_in_any_direction() -> None:
    """tilted-plane rises 5° at 30° from x."""
    report = json.loads(joulepath("maps", "check", "tilted-plane", "--json").stdout)
    assert report["slopes"]["steepest_deg"] == pytest.approx(5.0, abs=0.01)
    assert report["odd"] == []


def test_a_map_is_told_in_full_and_what_is_odd_about_it(tmp_path: Path) -> None:
    y, x = np.mgrid[0:40, 0:60]
    # A hill of 1.5 m in mm, in UTM.
    hill = 1500.0 * np.exp(-((x - 30.0) ** 2 + (y - 20.0) ** 2) / 80.0)
    place = {"cell": (0.25, 0.25), "origin": (431250.125, 4070120.125)}
    np.savez(tmp_path / "mm.npz", heights=hill, **place)
    told = joulepath("maps", "check", str(tmp_path / "mm.npz")).stdout
    assert "y 4070120 to 4070130 m" in told
    assert "perhaps they are in mm" in told
    asked = ("--map", str(tmp_path / "mm.npz"), "--start", "0,0", "--goal", "1,1")
    expect_refusal(joulepath("plan", *asked), "x from 431250 to 431265, y from 4070120 to 4070130")


def test_a_map_too_large_for_a_vehicle_is_told_all_the_same(tmp_path: Path) -> None:
    np.savez(tmp_path / "large.npz", heights=np.zeros((2001, 2001), np.float32), cell=(0.1, 0.1))
    asked = ("maps", "check", str(tmp_path / "large.npz"), "--vehicle", "minibalance")
    told = joulepath(*asked)
    assert told.returncode == 0
    assert "2001 by 2001" in told.stdout
    assert "at most 4,000,000 cells" in told.stdout
    expect_refusal(joulepath(*asked, "--report", str(tmp_path / "page.html")), "4,000,000 cells")


def test_a_map_is_checked() -> None:
    report = json.loads(joulepath("maps", "check", "warehouse", "--json").stdout)
    assert report["extent_m"] == pytest.approx([0.0, 0.0, 30.0, 20.0])
    assert report["ground_shares"]["carpet"] > 0.0
    told = joulepath("maps", "check", "warehouse")
    for word in ("extent", "slopes", "obstacles", "unknown", "carpet"):
        assert word in told.stdout
    told = joulepath("maps", "check", "warehouse", "--vehicle", "minibalance").stdout
    assert "minibalance: " in told
    assert "too steep" in told
    expect_refusal(joulepath("maps", "check"), "maps check FILE")
    expect_refusal(joulepath("maps", "check", "atlantis"), "atlantis")
