"""Programs that the documents show run as they stand."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def _examples() -> list[tuple[str, str]]:
    """Python blocks of the pages that show whole programs."""
    pages = {
        "README.md": (ROOT / "README.md").read_text(),
        "python.md": (ROOT / "docs" / "python.md").read_text(),
        "diagnosis.md": (ROOT / "docs" / "diagnosis.md").read_text(),
    }
    return [
        (f"{name} {number}", block)
        for name, text in pages.items()
        for number, block in enumerate(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    ]


@pytest.mark.parametrize(("name", "program"), _examples(), ids=lambda value: value[:12])
def test_example_runs(name: str, program: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=180
    )
    assert done.returncode == 0, f"{name}: {done.stderr[-2000:]}"
