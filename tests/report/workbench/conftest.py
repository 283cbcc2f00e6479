"""Results of the workbench, and the pages about them."""

from __future__ import annotations

import pytest

from planner.report import write_report
from tests.telemetry.diagnosis import synthetic_results as results
from tests.telemetry.diagnosis.synthetic_results import EVIL, RESULTS, Material


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Material:
    return results.material(tmp_path_factory.mktemp("logs"))


@pytest.fixture(scope="session")
def pages(made: Material, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("pages") / "made" / "on demand"
    written = {}
    for name, make in RESULTS.items():
        write_report(make(made), folder / f"{name}.html", f"{name} {EVIL}")
        written[name] = (folder / f"{name}.html").read_text(encoding="utf-8")
    return written
