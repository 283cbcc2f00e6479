"""Time and memory of naming on long logs: 100,000 rows and 10 million rows of Parquet.

    measure(100_000) -> {"rows", "seconds", "whole_process_s", "peak_mib", "selected", ...}

The robot of the hidden-effects benchmark drives 100,000 rows, with air drag hidden; longer logs
repeat the drive under new labels of runs and with new noise. Each diagnosis runs in a process of
its own, after a short one that leaves compiled code on disk, so that the peak of resident memory is
its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from planner.telemetry.virtual import Noise, VirtualRobot
from tests.hidden_effects.logs import VEHICLE
from tests.hidden_effects.runner import DIAGNOSE, log_folder

RUN_ROWS = 3000
DRIVEN = 102_000  # rows, a multiple of RUN_ROWS
SHORT = 6 * RUN_ROWS  # enough runs for the noise that they differ by, so that its code is compiled
BARS = {100_000: (3.0, None), 10_000_000: (120.0, 1024.0)}  # s, MiB

PROGRAM = """
import json, sys, time
before = time.perf_counter()
from tests.hidden_effects.runner import function_of
diagnose = function_of(sys.argv[1])
if sys.argv[4] == "warm":
    diagnose(sys.argv[2], sys.argv[3])
    sys.exit(0)
imported = time.perf_counter()
answer = diagnose(sys.argv[2], sys.argv[3])
done = time.perf_counter()
found = answer if isinstance(answer, dict) else answer.to_json()
# Not getrusage's: a child begins there with the size of its parent.
with open("/proc/self/status") as lines:
    peak = next(int(x.split()[1]) for x in lines if x.startswith("VmHWM")) / 1024.0
sys.stdout.write(json.dumps({
    "seconds": done - imported, "whole_process_s": done - before, "peak_mib": peak,
    "verdict": found["verdict"], "selected": found["selected"],
}))
"""


def write_log(path: Path, rows: int) -> None:
    """Writes a Parquet log of this many rows, in row groups of one drive each."""
    import pyarrow
    import pyarrow.parquet

    runs = DRIVEN // RUN_ROWS
    robot = VirtualRobot(VEHICLE, hidden={"air_drag": {"drag_area": 0.15}}, seed=5)
    drive = robot.profile("rich", runs=runs, rows=RUN_ROWS)
    log = robot.drive(drive, noise=Noise(level=0.02))
    clean = log.truth["clean_power"]
    columns = {
        name: np.asarray(values, dtype=np.float32)
        for name, values in log.columns.items()
        if name not in ("run", "surface", "time", "power")
    }
    columns["time"] = np.asarray(log.columns["time"], dtype=np.float64)
    surface = pyarrow.array(log.columns["surface"].tolist()).dictionary_encode()
    spread = 0.02 * np.maximum(np.abs(clean), 0.3 * np.mean(np.abs(clean)))
    number = np.repeat(np.arange(runs), RUN_ROWS)
    writer = None
    for block in range(-(-rows // DRIVEN)):
        rng = np.random.default_rng([5, block])
        count = min(DRIVEN, rows - block * DRIVEN)
        power = clean + spread * rng.standard_normal(len(clean))
        names = [f"run{block:03d}-{k:02d}" for k in range(runs)]
        run = pyarrow.DictionaryArray.from_arrays(number.astype(np.int32), names)
        data = {"run": run.cast(pyarrow.string()), "power": pyarrow.array(power)}
        data |= {name: pyarrow.array(values) for name, values in columns.items()}
        data["surface"] = surface.cast(pyarrow.string())
        table = pyarrow.table(data).slice(0, count)
        if writer is None:
            writer = pyarrow.parquet.ParquetWriter(str(path), table.schema)
        writer.write_table(table)
    assert writer is not None
    writer.close()


def measure(rows: int, diagnose: str = DIAGNOSE) -> dict[str, Any]:
    """Seconds of the call, of the whole process, and the peak of resident memory.

    Args:
        rows: length of the log; it is made once and kept in a folder for temporary files.
        diagnose: ``module:function``.
    """
    folder = log_folder() / "long"
    folder.mkdir(parents=True, exist_ok=True)
    for length in (SHORT, rows):
        path = folder / f"{length}.parquet"
        if not path.exists():
            passing = path.with_suffix(".part")
            write_log(passing, length)
            passing.rename(path)
        warm = "warm" if length == SHORT else "measured"
        before = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM, diagnose, str(path), VEHICLE, warm],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
            cwd=Path(__file__).resolve().parents[2],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            print(done.stderr, file=sys.stderr)
            return {"rows": rows, "error": done.stderr.strip().splitlines()[-1], "holds": False}
    found: dict[str, Any] = {"rows": rows, **json.loads(done.stdout)}
    found["with_start_s"] = time.perf_counter() - before
    seconds, memory = BARS.get(rows, (None, None))
    found["bar"] = f"≤ {seconds} s" + (f", ≤ {memory:.0f} MiB" if memory else "")
    found["holds"] = (seconds is None or found["seconds"] <= seconds) and (
        memory is None or found["peak_mib"] <= memory
    )
    return {k: round(v, 2) if isinstance(v, float) else v for k, v in found.items()}


if __name__ == "__main__":
    for length in [int(word) for word in sys.argv[1:]] or sorted(BARS):
        print(json.dumps(measure(length)), flush=True)
