"""``compare-planners``: one document or one table, a page, and a silent end."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from planner.search.ompl.sampling import SAMPLERS
from tests.service.cli.command import expect_refusal, joulepath

ASKED = {"map": "test-bench", "start": {"x": 1.0, "y": 1.5}, "goal": {"x": 13.0, "y": 1.5}}
QUICK = ("--seconds", "0.3", "--runs", "1")


@pytest.fixture
def request_file(tmp_path: Path) -> Path:
    file = tmp_path / "request.json"
    file.write_text(json.dumps(ASKED))
    return file


def test_every_planner_has_a_row_a_dot_and_the_end_is_silent(request_file: Path) -> None:
    page = request_file.with_name("page.html")
    done = joulepath("compare-planners", str(request_file), *QUICK, "--json", "--report", str(page))
    # OMPL's bindings would complain here at exit.
    assert (done.returncode, done.stderr) == (0, "")
    rows = json.loads(done.stdout)["planners"]
    assert [row["planner"] for row in rows] == ["least-energy", *SAMPLERS]
    assert rows[0]["energy_j"] > 0.0
    assert "least-energy" in page.read_text()


def test_a_sampler_cannot_pass_via_places(request_file: Path) -> None:
    request_file.write_text(json.dumps({**ASKED, "via": [{"x": 5.0, "y": 1.5}]}))
    expect_refusal(joulepath("compare-planners", str(request_file), *QUICK), "via")
