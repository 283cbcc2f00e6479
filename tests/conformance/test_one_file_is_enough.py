"""A new effect is one new file: everything else follows from it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SLUG = "towed_rope"
FILE = '''"""Towed rope: a rope that is dragged along a rough floor.

    F = t along the direction of travel, only forward motion pulls it taut

Sign
    a resistance while driving forward.
Source
    own, for a test.
Holds for
    a rope that hangs behind the robot.
Left out
    the rope's own weight.
"""

from planner.power.effect import Effect, Parameter, WorkedExample
from planner.power.kernel_math import positive, sign


class TowedRope(Effect):
    """Force of a rope behind the robot."""

    slug = "towed_rope"
    title = "a rope behind the robot"
    loss = True

    rope_force = Parameter(unit="N", default=3.0, null=0.0, bounds=(0.0, 50.0), doc="Of the rope.")

    @staticmethod
    def body_force(vx, rope_force):
        """N, N, N·m that the wheels must supply."""
        force = rope_force * positive(sign(vx, 0.05))
        return force, 0.0 * force, 0.0 * force

    examples = (
        WorkedExample("body_force", {"vx": 500.0, "rope_force": 3}, (3.0, 0.0, 0.0), "3·1"),
    )
'''


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("effects")
    (folder / f"{SLUG}.py").write_text(FILE, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "tests.conformance.one_more_effect", str(folder)],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_catalogue_page_and_benchmark_name_it(seen: dict[str, Any]) -> None:
    assert seen["listed"]
    assert seen["on_the_page"]
    assert seen["cases"] == ["one", "two"]


def test_a_virtual_robot_hides_it_by_its_formula(seen: dict[str, Any]) -> None:
    assert seen["hidden"] == {"rope_force": 3.0, "size": 0.08}
    assert seen["size"] == pytest.approx(0.08, rel=0.02)


def test_a_diagnosis_finds_it_where_it_is_and_nowhere_else(seen: dict[str, Any]) -> None:
    assert seen["selected"] == [SLUG]
    assert SLUG not in seen["not_there"]


def test_routes_avoid_what_it_costs_and_keep_their_bound(seen: dict[str, Any]) -> None:
    # Backwards the rope hangs slack: 20 m and more would cost 60 J and more forwards.
    assert seen["forward_m"] < -20.0
    assert 0.0 <= seen["in_the_account_j"] < 5.0
    assert 0.0 < seen["gap"] < 1.0
