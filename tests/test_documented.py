"""Every command, setting and HTTP route that users meet is named in docs/."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
DOCS = {path.name: path.read_text() for path in sorted((ROOT / "docs").glob("*.md"))}


@pytest.mark.parametrize("target", ["demo", "test", "check", "bench", "serve", "setup", "lock"])
def test_make_target_is_documented(target: str) -> None:
    text = DOCS["development.md"] + (ROOT / "README.md").read_text()
    assert f"make {target}" in text
