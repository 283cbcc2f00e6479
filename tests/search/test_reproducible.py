"""The same request with the same seed and an iteration limit, in fresh processes."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = """
import json, sys
sys.path.insert(0, {root!r})
from planner import plan_route
from tests.search.maps import hills, terrain
answer = plan_route(
    terrain=terrain(hills()), start={{"x": 2, "y": 2}}, goal={{"x": 21, "y": 20}},
    seed={seed}, iterations=1500,
)
sys.stdout.write(json.dumps(answer.to_json()["routes"][0]["poses"]))
"""


def routes(seeds: list[int]) -> list[str]:
    """Digest of the poses that a fresh process finds, for each of the seeds.

    Sets come in another order in each process.
    """
    running = [
        subprocess.Popen(
            [sys.executable, "-c", PROGRAM.format(root=str(ROOT), seed=seed)],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONHASHSEED": str(number)},
        )
        for number, seed in enumerate(seeds)
    ]
    found = []
    for process in running:
        out, _ = process.communicate(timeout=300)
        assert process.returncode == 0
        assert len(json.loads(out)) > 20
        found.append(hashlib.sha256(out.encode()).hexdigest())
    return found


def test_same_seed_and_iterations_give_the_same_route():
    """To the last bit."""
    assert len(set(routes([7] * 3))) == 1
