"""Parameters with their uncertainty, and what they were before."""

from __future__ import annotations

from tests.report.workbench.reading import rows_of
from tests.telemetry.diagnosis.synthetic_results import Material


def test_parameters_with_their_uncertainty(pages: dict[str, str], made: Material) -> None:
    rows = {row[0]: row for row in rows_of(pages["diagnosis"], "Parameters")}
    drag = next(p for p in made.full.parameters if p.effect == "air_drag")
    row = rows[f"air_drag.{drag.name}"]
    assert row[1:5] == [f"{drag.value:.4g}", f"{drag.stderr:.2g}", "m²", ""]
    load = next(p for p in made.full.parameters if p.name == "power")
    before = next(p for p in made.base.parameters if p.name == "power")
    assert rows["electronics.power"][1:5] == [
        f"{load.value:.4g}", f"{load.stderr:.2g}", "W", f"{before.value:.4g}",
    ]  # fmt: skip
