"""Broken logs are refused in one sentence; odd ones are read, and the oddity is said."""

from __future__ import annotations

import gzip
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from planner.errors import LogError
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.logs.columns import REQUIRED
from planner.telemetry.logs.log import Telemetry
from tests.telemetry.odd_logs import (
    GAPPED,
    LATER,
    ODD,
    SOUND,
    as_bytes,
    changed,
    column,
    kinds,
    spoilt,
    table,
    text,
    written,
)


def cut_parquet(folder: Path) -> Path:
    pq.write_table(pa.table(table()), folder / "log.parquet")
    whole = (folder / "log.parquet").read_bytes()
    (folder / "log.parquet").write_bytes(whole[: len(whole) // 2])
    return folder / "log.parquet"


def damaged_parquet(folder: Path) -> Path:
    pq.write_table(pa.table(table(6000)), folder / "log.parquet")
    whole = bytearray((folder / "log.parquet").read_bytes())
    whole[60:4000] = b"\xff" * 3940
    (folder / "log.parquet").write_bytes(whole)
    return folder / "log.parquet"


def parquet(**columns: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        pq.write_table(pa.table(table() | columns), folder / "log.parquet")
        return folder / "log.parquet"

    return write


BACK = table()["time"].copy()


BACK[17] = 0.35


AGAIN = ["a"] * 20 + ["b"] * 20 + ["a"] * 20


REFUSED: dict[str, tuple[Callable[[Path], Path], str]] = {
    "no such file": (lambda folder: folder / "nothing.csv", "cannot be opened"),
    "folder": (lambda folder: folder, "folder"),
    "zero byte in path": (lambda folder: folder / "a\0b.csv", "cannot be opened"),
    "empty": (as_bytes(b""), "is empty"),
    "headings only": (as_bytes(b"run,time,vx,vy,wz,power\n"), "no rows"),
    "blank first line": (as_bytes(b"\n" + SOUND.encode()), "blank"),
    "no headings": (as_bytes(SOUND.partition("\n")[2].replace("run ", "").encode()), "headings"),
    "binary": (as_bytes(bytes(range(256)) * 40), "zero bytes|UTF-8|separator"),
    "prose": (as_bytes(b"Dear Sir\nplease find enclosed\n"), "no separator"),
    "JSON": (as_bytes(b'{"run": [1, 2], "time": [1, 2]}'), "JSON"),
    "spreadsheet": (as_bytes(b"PK\x03\x04" + b"x" * 99), "spreadsheet"),
    "HDF5": (as_bytes(b"\x89HDF\r\n\x1a\n" + b"x" * 99), "HDF5"),
    "UTF-16": (as_bytes(SOUND.encode("utf-16")), "UTF-16"),
    "Latin-1 headings": (as_bytes("run,time,vx,vy,wz,power,Höhe\n1".encode("latin-1")), "UTF-8"),
    "Latin-1 label": (
        as_bytes(SOUND.replace("run 1", "Fährte").encode("latin-1")),
        "UTF-8",
    ),
    "carriage returns": (as_bytes(SOUND.replace("\n", "\r").encode()), "carriage return"),
    "huge header": (as_bytes(b"a," * 600_000), "first line is longer"),
    "many columns": (as_bytes((",".join(f"c{i}" for i in range(3000)) + "\n1").encode()), "many"),
    "damaged gzip": (
        as_bytes(gzip.compress(SOUND.encode())[:-300], "log.csv.gz"),
        "damaged|cut|br",
    ),
    "gzip of nothing": (as_bytes(gzip.compress(b""), "log.csv.gz"), "blank|empty|no rows"),
    "Parquet cut off": (cut_parquet, "cut off"),
    "Parquet damaged": (damaged_parquet, "damaged|not UTF-8"),
    "Parquet without rows": (
        parquet(**{k: pa.array([], pa.float64()) for k in table()}),
        "no rows",
    ),
    "Parquet text as numbers": (parquet(power=["many"] * 60), "'power'.*numeric"),
    "Parquet lists": (parquet(power=[[1.0]] * 60), "'power'.*numeric"),
    **{f"no {name}": (changed(**{name: None}), f"no column '{name}'") for name in REQUIRED},
    "missing columns": (changed(power=None, vy=None), "'vy', 'power'"),
    "misspelt column": (changed(power=None, Power=table()["power"]), "'Power' for power"),
    "unit in heading": (changed(vx=None, **{"vx [m/s]": table()["vx"]}), r"'vx \[m/s\]' for vx"),
    "duplicate column": (as_bytes(SOUND.replace("vy", "vx", 1).encode()), "same heading.*'vx'"),
    "word for a number": (changed(power=spoilt("power", 41, "high")), "'power'.*row 42.*'high'"),
    "number with unit": (changed(vx=spoilt("vx", 2, "0.5 m/s")), "'vx'.*row 3.*'0.5 m/s'"),
    "number with underscore": (changed(vx=spoilt("vx", 2, "1_0")), "'vx'.*row 3.*'1_0'"),
    "Latin-1 in a ragged line": (
        as_bytes(SOUND.encode() + "run 1,Höhe\n".encode("latin-1")),
        "UTF-8",
    ),
    "text in time": (changed(time=[f"12:00:{k:02d}" for k in range(60)]), "'time'.*row 1.*moments"),
    "wheel speeds alone": (
        changed(vx=None, vy=None, wz=None, wheel_speed_1=[1.0] * 60),
        "'vx', 'vy', 'wz'.*from wheel speeds, joulepath logs join",
    ),
    "a row for each topic": (
        changed(vx=[0.1, ""] * 30, power=["", 9.0] * 30),
        "none of its 60 rows.*30 have no value in 'vx'.*joulepath logs join",
    ),
    "nothing measured": (changed(power=[""] * 60), "none of its 60 rows.*60 have no value"),
    "all infinite": (changed(vx=[math.inf] * 60), "none of its 60 rows"),
    "time runs back": (changed(time=BACK), r"backwards.*row 18.*'run 0'"),
    "runs mixed": (changed(run=AGAIN, time=LATER), "run 'a' are not consecutive.*row 41"),
    "speed in mm/s": (changed(vx=table()["vx"] * 1e3), "vx: 60 of 60.*mm/s"),
    "pitch in degrees": (changed(pitch=np.linspace(-9.0, 9.0, 60)), "pitch.*degrees"),
    "temperature in kelvin": (changed(ambient_temp=np.full(60, 293.0)), "ambient_temp.*kelvin"),
    "motor in kelvin": (changed(motor_temp=np.full(60, 310.0)), "motor_temp.*kelvin"),
    "power in µW": (changed(power=table()["power"] * 1e6), "power: 60 of 60"),
    "time in ms": (changed(time=table()["time"] * 1e4), "time.*not s"),
    "time in ns since 1970": (changed(time=1.7e18 + table()["time"] * 1e9), "time.*ns"),
    "power negative": (changed(power=-table()["power"]), "power.*negative in 60 of 60.*sign = -1"),
    # ROS counts discharge as negative, and shunts speak of mV and mA; no column is named power.
    "current negative": (
        changed(power=None, battery_voltage=[24.0] * 60, battery_current=-table()["power"]),
        r"battery_voltage · battery_current, is negative.*turns battery_current with sign = -1",
    ),
    "current in mA, voltage in mV": (
        changed(power=None, battery_voltage=[24e3] * 60, battery_current=300.0 + table()["power"]),
        "battery_voltage · battery_current, 60 of 60 rows.*mA or mV are read as A and V",
    ),
    "ragged": (
        as_bytes(SOUND.replace(",0.1,", ",0.1,7,").encode() + b"a,b\n" * 9),
        "more or fewer",
    ),
    "endless line": (as_bytes(SOUND.encode() + b"9" * 20_000_000), "too long|fewer cells"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_broken_log_is_refused_in_one_sentence(tmp_path: Path, name: str) -> None:
    write, says = REFUSED[name]
    with pytest.raises(LogError, match=says) as caught:
        Telemetry.read(write(tmp_path))
    sentence = str(caught.value)
    assert "; accepted: " in sentence
    assert "\n" not in sentence
    assert len(sentence) < 1000


def test_degrees_of_a_level_floor_are_not_taken_for_slopes_in_silence(tmp_path: Path) -> None:
    rough = changed(pitch=np.linspace(-0.2, 0.2, 60), roll=np.linspace(-1.0, 1.0, 60))
    assert kinds(Telemetry.read(rough(tmp_path))) == {("unit", "roll")}


@pytest.mark.parametrize("name", ODD)
def test_an_odd_log_is_read_and_the_oddity_is_said(tmp_path: Path, name: str) -> None:
    write, finding, count = ODD[name]
    log = Telemetry.read(write(tmp_path))
    assert finding in kinds(log), log.report
    assert len(log) == count
    left_out = sum(f.rows for f in log.report if f.kind in ("missing", "impossible", "doubled"))
    assert count + left_out == 60
    assert np.isfinite(log.rows[:, [INDEX["ax"], INDEX["ay"], INDEX["slope_rate"]]]).all()


def test_a_single_impossible_value_is_left_out_and_counted(tmp_path: Path) -> None:
    columns = table(600)
    columns["vx"][41] = 300.0
    log = Telemetry.read(written(tmp_path, columns))
    (finding,) = [f for f in log.report if f.kind == "impossible"]
    assert (finding.column, finding.rows) == ("vx", 1)
    assert "row 42" in finding.sentence
    assert len(log) == 599
    assert np.abs(column(log, "ax")).max() < 1.0


def test_a_slower_meter_in_the_same_table_is_sent_to_join(tmp_path: Path) -> None:
    log = Telemetry.read(changed(power=[9.0, "", "", "", ""] * 12)(tmp_path))
    (found,) = [f for f in log.report if f.kind == "missing"]
    assert "48 rows with no value left out" in found.sentence
    assert "joulepath logs join" in found.sentence


def test_times_in_whole_seconds_lose_most_rows_and_are_said(tmp_path: Path) -> None:
    log = Telemetry.read(changed(time=np.floor(table()["time"]))(tmp_path))
    (found,) = [f for f in log.report if f.kind == "doubled"]
    assert "rounded" in found.sentence
    assert found.rows + len(log) == 60


def test_row_numbers_count_the_rows_of_the_file(tmp_path: Path) -> None:
    columns = table(600)
    columns["vx"][499] = math.nan
    lines = text(columns).splitlines()
    lines.insert(100, "a,b")  # becomes row 100
    (tmp_path / "log.csv").write_text("\n".join(lines))
    log = Telemetry.read(tmp_path / "log.csv")
    sentences = " ".join(f.sentence for f in log.report)
    assert "row 100" in sentences
    assert "row 501" in sentences


def test_no_derivative_is_taken_across_a_gap(tmp_path: Path) -> None:
    speed = np.where(np.arange(60) > 30, 2.0, 0.5) + 0.01 * np.arange(60)
    columns = table(runs=1) | {"time": GAPPED, "vx": speed, "vy": np.zeros(60)}
    log = Telemetry.read(written(tmp_path, columns))
    assert np.allclose(column(log, "ax"), 0.1)  # 0.01 m/s every 0.1 s on both sides
    assert log.interval.max() == pytest.approx(0.1)


def test_gravity_in_the_logged_acceleration_is_noticed(tmp_path: Path) -> None:
    columns = table(runs=1)
    pitch = 0.2 * np.sin(columns["time"])
    zero = np.zeros(60)
    clean = columns | {"pitch": pitch, "wz": zero, "ax": 0.2 * np.cos(columns["time"]), "ay": zero}
    clean["vy"] = zero
    assert "gravity" not in {f.kind for f in Telemetry.read(written(tmp_path, clean)).report}
    raw = clean | {"ax": clean["ax"] - STANDARD_GRAVITY * np.sin(pitch)}
    assert "gravity" in {f.kind for f in Telemetry.read(written(tmp_path, raw)).report}


def test_acceleration_in_g_is_noticed_and_noise_is_not_taken_for_it(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    columns = table(600, runs=1)
    time, noise = columns["time"], rng.standard_normal(600)
    columns |= {"vx": 0.4 * np.sin(time), "vy": np.zeros(600), "wz": np.zeros(600)}
    true = 0.4 * np.cos(time)

    def noticed(**changes: Any) -> bool:
        return ("unit", "ax") in kinds(Telemetry.read(written(tmp_path, columns | changes)))

    assert noticed(ax=true / STANDARD_GRAVITY)
    assert not noticed(ax=true)
    # Noise of the accelerometer, of the odometry, and of a sensor that shows nothing else.
    assert not noticed(ax=true + noise)
    assert not noticed(ax=true, vx=columns["vx"] + 0.1 * noise)
    assert not noticed(ax=0.001 * noise)


@pytest.mark.parametrize("block", [50, 131, 5000])
def test_a_late_row_is_left_out_wherever_blocks_end(tmp_path: Path, block: int) -> None:
    straight = table(400, runs=2)
    place = {"first": 130, "second": 317}
    late = {name: np.array(column) for name, column in straight.items()}
    for at in place.values():
        order = np.r_[0:at, at + 1 : at + 4, at, at + 4 : 400]
        late = {name: column[order] for name, column in late.items()}
    path = written(tmp_path, late)
    parts = list(Telemetry.chunks(path, rows=block))
    kept = np.delete(straight["time"], list(place.values()))
    assert np.concatenate([part.time for part in parts]) == pytest.approx(kept)
    assert [f.sentence for f in parts[-1].report if f.kind == "late"] == [
        "time: 2 rows with a time before that of an earlier row left out, the first is row 134"
    ]


@pytest.mark.parametrize("ahead", [False, True])
def test_a_clock_that_was_set_is_no_late_row(tmp_path: Path, ahead: bool) -> None:
    """Back from a row on, for less than a hundredth of the rows; or one row far ahead."""
    columns = table(4000, runs=1, interval=0.05)
    time = columns["time"].copy()
    time[slice(3000, 3001) if ahead else slice(3000, None)] += 100.0 if ahead else -1.0
    row = 3002 if ahead else 3001
    with pytest.raises(LogError, match=f"time: runs backwards by .* in row {row}"):
        Telemetry.read(written(tmp_path, columns | {"time": time}))
