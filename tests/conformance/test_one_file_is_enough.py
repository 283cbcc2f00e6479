"""A new effect is one new file, the one that its page shows: everything else follows from it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.documents.blocks import blocks_of

SLUG = "towed_rope"
PAGE = "docs/adding-an-effect.md"


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("effects")
    (file,) = (block.text for block in blocks_of(PAGE) if f"{SLUG}.py" in block.title)
    (folder / f"{SLUG}.py").write_text(file, encoding="utf-8")
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
