"""How far a job is, in a small file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from service.jobs import progress


def test_progress_files_hold_the_last_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    moments = iter([10.0, 10.05, 10.06])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(moments))
    path = tmp_path / "progress"
    assert progress.read(path) is None
    report = progress.reporter(path)
    report(0.25, "a quarter")
    report(0.26, "too soon after the last one")
    assert progress.read(path) == (0.25, "a quarter")
    report(1.0, "done")
    assert progress.read(path) == (1.0, "done")
    path.write_text("[0.5, ")
    assert progress.read(path) is None
    assert os.listdir(tmp_path) == ["progress"]
