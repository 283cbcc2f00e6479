"""Tables in memory are logs like files: the same rows, the same findings, the same sentences."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from planner.errors import LogError
from planner.telemetry.logs import Telemetry
from planner.telemetry.sampling import open_source
from tests.telemetry.odd_logs import table, written


def test_a_dataframe_is_the_log_of_its_columns(tmp_path: Path) -> None:
    columns = table() | {"surface": ["tile"] * 60, "motor_temp": np.linspace(20.0, 30.0, 60)}
    file = Telemetry.read(written(tmp_path, columns))
    for given in (pd.DataFrame(columns), pa.table(columns)):
        log = Telemetry.read(given)
        assert np.array_equal(log.rows, file.rows, equal_nan=True)
        assert np.array_equal(log.power, file.power)
        assert (log.run_names, log.surfaces, log.report) == (file.run_names, file.surfaces, ())
        assert (log.present, log.assumed) == (file.present, file.assumed)
        assert log.source == type(given).__name__


def test_units_of_a_dataframe_convert_as_those_of_a_file(tmp_path: Path) -> None:
    columns = table()
    shown = pd.DataFrame({k: v for k, v in columns.items() if k not in ("run", "vx", "power")})
    shown["Vel X [mm/s]"] = 1000.0 * columns["vx"]
    shown["P"] = -0.001 * columns["power"]
    mapping = {
        "columns": {
            "Vel X [mm/s]": {"quantity": "vx", "unit": "mm/s"},
            "P": {"quantity": "power", "unit": "kW", "sign": -1},
        },
        "constants": {"run": "yard", "payload": {"value": 2000, "unit": "g"}},
    }
    log = Telemetry.read(shown.iloc[:30], mapping)
    expected = Telemetry.read(written(tmp_path, columns))
    assert np.allclose(log.power, expected.power[:30])
    assert log.run_names == ("yard",)
    assert np.allclose(log.rows[:, :3], expected.rows[:30, :3])


def test_times_and_labels_of_pandas_are_read() -> None:
    columns = table()
    times = pd.to_datetime(1.7e9 + columns["time"], unit="s")
    frame = pd.DataFrame({k: v for k, v in columns.items() if k != "time"}, index=times)
    frame["run"] = frame["run"].astype("category")
    log = Telemetry.read(frame.rename_axis("time"))
    assert np.allclose(np.diff(log.time[:30]), 0.1)
    assert log.run_names == ("run 0", "run 1")


def test_missing_cells_are_left_out_as_in_a_file() -> None:
    frame = pd.DataFrame(table())
    frame.loc[5, "power"] = np.nan
    log = Telemetry.read(frame)
    assert len(log) == 59
    assert any("power" in finding.sentence for finding in log.report)


def test_a_table_is_the_log_of_a_diagnosis() -> None:
    source = open_source(pd.DataFrame(table()))
    assert source.complete
    assert source.describe() | {"report": None, "derived": None, "assumed": None} == {
        "source": "DataFrame",
        "sha256": None,
        "rows": 60,
        "runs": 2,
        **dict.fromkeys(("report", "derived", "assumed")),
    }


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (pd.DataFrame(), "DataFrame: has no rows"),
        (pd.DataFrame(table()).drop(columns="power"), "DataFrame: has no column 'power'"),
        (pd.DataFrame(table()).rename(columns={"vx": "v_x"}), "did you mean 'v_x' for vx?"),
        (pd.DataFrame(table()).assign(vx="fast"), "DataFrame: column 'vx' holds"),
        (
            pd.DataFrame(table()).assign(vx=["fast", *[1.0] * 59]),
            "DataFrame: cannot be read: ",
        ),
        (pd.DataFrame(np.ones((3, 2)), columns=["vx", "vx"]), "DataFrame: cannot be read: "),
        (pd.Series([1.0, 2.0]), "Series: cannot be read: "),
        ({"time": [1.0]}, "log: is not a log (got {'time': [1.0]})"),
        (7, "log: is not a log (got 7)"),
    ],
    ids=str,
)
def test_a_table_that_is_no_log_gets_one_sentence(given: Any, said: str) -> None:
    with pytest.raises(LogError) as caught:
        Telemetry.read(given)
    assert said in str(caught.value)
    assert "; accepted: " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_mapping_that_is_none_gets_one_sentence() -> None:
    with pytest.raises(LogError, match=r"mapping: is not a mapping \(got 7\)"):
        Telemetry.read(pd.DataFrame(table()), 7)  # type: ignore[arg-type]
    with pytest.raises(LogError, match="mapping: column_: no such key; did you mean 'columns'"):
        Telemetry.read(pd.DataFrame(table()), {"column_": {}})
