"""The commands and JSON keys, tried from outside by a program that knows nothing of the code."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
CHECK = ROOT.parent / "shared" / "contract" / "check_contract.py"


@pytest.mark.skipif(not CHECK.exists(), reason="the contract's checker is not beside the project")
def test_the_contract_of_planning_holds():
    """Every line of the checker's report is ok."""
    command = [sys.executable, str(CHECK), str(Path(sys.executable).with_name("joulepath")), "plan"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout
