"""The commands that list what is installed."""

from __future__ import annotations

import json
import subprocess
import sys

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


@pytest.mark.parametrize("asked", ["maps", "--help", "plan --help"])
def test_what_needs_no_kernel_loads_no_compiler(asked: str) -> None:
    script = (
        "import sys; from service.cli import run\n"
        "heavy = {'numba', 'scipy', 'ompl', 'fastapi', 'rasterio'}\n"
        f"try: run({asked.split()!r})\n"
        "finally: sys.exit(bool(heavy & {*sys.modules}))"
    )
    assert subprocess.run([sys.executable, "-c", script], stdout=subprocess.DEVNULL).returncode == 0


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
