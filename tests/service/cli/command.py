"""The installed command, run from outside."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

JOULEPATH = Path(sys.executable).parent / "joulepath"
START_AND_GOAL = ("--start", "1,1", "--goal", "2,2")


def joulepath(*arguments: str, text: str | None = None) -> subprocess.CompletedProcess[str]:
    """Run the installed command."""
    return subprocess.run(
        [JOULEPATH, *arguments], capture_output=True, text=True, input=text, timeout=120
    )


def expect_refusal(done: subprocess.CompletedProcess[str], *words: str) -> None:
    """Exit 2, nothing on stdout, one line on stderr that holds the words."""
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1
    for word in words:
        assert word in done.stderr
