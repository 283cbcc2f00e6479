"""Tables of CSV and Parquet, block by block."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from planner.errors import LogError
from planner.telemetry.logs.log import Telemetry
from tests.telemetry.odd_logs import (
    table,
    written,
)


def test_timestamps_and_labels_of_parquet(tmp_path: Path) -> None:
    columns = table()
    columns["time"] = pa.array((columns["time"] * 1000).astype(int), pa.timestamp("ms"))
    stamps = pa.table(columns)
    columns["run"] = pa.array(columns["run"]).dictionary_encode()
    columns["vx"] = pa.array(columns["vx"], pa.float32())
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    log = Telemetry.read(tmp_path / "log.parquet")
    assert log.time[:2] == pytest.approx([0.1, 0.2])
    assert log.run_names == ("run 0", "run 1")
    assert log.report == ()
    # Their type has the unit; one more would convert them twice.
    stated = {"columns": {"time": {"quantity": "time", "unit": "ms"}}}
    for given in (tmp_path / "log.parquet", stamps):
        with pytest.raises(LogError, match="holds dates"):
            Telemetry.read(given, stated)


@pytest.mark.parametrize("size", [1, 2, 7, 30, 31, 59, 60, 1000])
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_chunks_equal_the_whole_bit_by_bit(tmp_path: Path, size: int, form: str) -> None:
    columns = table()
    columns["time"] = np.delete(np.arange(1, 80) * 0.1, [4, 5, 6, 50])[:60]
    columns["pitch"] = 0.1 * np.sin(columns["time"])
    columns["power"][[0, 17, 29, 59]] = np.nan
    path = written(tmp_path, columns)
    if form == "parquet":
        path = tmp_path / "log.parquet"
        pq.write_table(pa.table(columns), path, row_group_size=13)
    whole = Telemetry.read(path)
    parts = list(Telemetry.chunks(path, rows=size))
    for name in ("rows", "power", "run", "time", "interval"):
        together = np.concatenate([getattr(part, name) for part in parts])
        assert np.array_equal(together, getattr(whole, name), equal_nan=True), name
    assert len(whole) == 56
    assert parts[-1].run_names == whole.run_names
    assert {f.kind for f in parts[-1].report} == {f.kind for f in whole.report}


@pytest.mark.parametrize("form", ["%Y-%m-%dT%H:%M:%S.%f", "%Y-%m-%d %H:%M:%S.%f+00:00"])
def test_dates_of_a_csv_are_seconds_since_1970(tmp_path: Path, form: str) -> None:
    columns = table()
    # 86,400 s after the beginning of 1970 and 0.1 s for every row.
    begin = datetime(1970, 1, 2)
    columns["time"] = [
        (begin + timedelta(seconds=float(t))).strftime(form) for t in table()["time"]
    ]
    log = Telemetry.read(written(tmp_path, columns))
    assert log.time == pytest.approx(86400.0 + table()["time"], abs=1e-6)
    assert any("time is a date" in finding.sentence for finding in log.report)
    with pytest.raises(LogError, match="holds dates"):
        Telemetry.read(
            written(tmp_path, columns), {"columns": {"time": {"quantity": "time", "unit": "ms"}}}
        )
    columns["time"][7] = "noon"
    with pytest.raises(LogError, match="row 8"):
        Telemetry.read(written(tmp_path, columns))
