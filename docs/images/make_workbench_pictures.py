"""Makes the workbench-*.svg beside this file out of a virtual drive; started by hand."""

from __future__ import annotations

import tempfile
from pathlib import Path

from planner import adopt, compare
from planner.telemetry.virtual import Noise, VirtualRobot

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Drive with hidden air drag as docs/diagnosis.md does, adopt, draw."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "drive.csv"
        robot = VirtualRobot("minibalance", hidden={"air_drag": {"size": 0.08}}, seed=3)
        robot.drive("rich", noise=Noise(level=0.02)).split()[0].write_csv(log)
        compare(log, "minibalance").figure("regimes").save(HERE / "workbench-where.svg")
        adoption = adopt("diagnosed", log, "minibalance")
    for name, picture in (("candidates", "which"), ("headwind", "curve"), ("time", "time")):
        adoption.diagnosis.figure(name).save(HERE / f"workbench-{picture}.svg")
    adoption.figure("history").save(HERE / "workbench-history.svg")


if __name__ == "__main__":
    main()
