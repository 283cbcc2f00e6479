"""Telemetry logs: what is read, derived, assumed, found odd, and refused."""

from __future__ import annotations

import gzip
import math
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from planner.errors import LogError
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.log import Telemetry

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
Table = dict[str, Any]


def table(count: int = 60, runs: int = 2, interval: float = 0.1) -> Table:
    """A sound log: a slalom at changing speed, two runs."""
    each = count // runs
    k = np.arange(count) % each
    t = (k + 1) * interval
    return {
        "run": [f"run {i}" for i in np.arange(count) // each],
        "time": t,
        "vx": 0.5 + 0.2 * np.sin(t),
        "vy": 0.1 * np.cos(2.0 * t),
        "wz": 0.3 * np.sin(1.5 * t),
        "power": 40.0 + 10.0 * np.sin(t + 0.3),
    }


def text(columns: Table, separator: str = ",", decimal: str = ".") -> str:
    """CSV of a table."""

    def cell(value: Any) -> str:
        return value if isinstance(value, str) else repr(float(value)).replace(".", decimal)

    lines = [separator.join(columns)]
    rows = zip(*columns.values(), strict=True)
    lines += [separator.join(cell(value) for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def written(folder: Path, columns: Table, name: str = "log.csv") -> Path:
    path = folder / name
    path.write_text(text(columns), encoding="utf-8")
    return path


def column(log: Telemetry, name: str) -> Any:
    return log.rows[:, INDEX[name]]


def kinds(log: Telemetry) -> set[tuple[str, str]]:
    return {(finding.kind, finding.column) for finding in log.report}


# What is read and derived.


def test_a_sound_log_has_nothing_to_report(tmp_path: Path) -> None:
    columns = table()
    log = Telemetry.read(written(tmp_path, columns))
    assert log.report == ()
    assert log.run_names == ("run 0", "run 1")
    assert np.array_equal(log.run, np.repeat([0, 1], 30))
    for name in ("vx", "vy", "wz"):
        assert np.array_equal(column(log, name), columns[name])
    assert np.array_equal(log.power, columns["power"])
    assert log.present == {"run", "time", "vx", "vy", "wz", "power"}
    assert any("flat" in sentence for sentence in log.assumed)
    assert np.all(column(log, "gravity_normal") == STANDARD_GRAVITY)
    assert log.wheel_currents is None


def test_acceleration_on_a_circle_points_to_its_centre(tmp_path: Path) -> None:
    # 0.8 m/s forward at 0.5 rad/s: v·ω = 0.4 m/s² to the left, nothing forward.
    columns = table() | {"vx": np.full(60, 0.8), "vy": np.zeros(60), "wz": np.full(60, 0.5)}
    log = Telemetry.read(written(tmp_path, columns))
    assert np.allclose(column(log, "ay"), 0.4)
    assert np.allclose(column(log, "ax"), 0.0, atol=1e-12)


def test_derivatives_are_exact_for_parabolas_on_uneven_times_and_stay_within_runs(
    tmp_path: Path,
) -> None:
    t = np.cumsum(np.tile([0.1, 0.2, 0.15], 20))
    t = np.concatenate([t[:30], t[:30]])
    sign = np.repeat([1.0, -1.0], 30)
    columns = table() | {
        "time": t,
        "vx": sign * t * t,
        "vy": np.zeros(60),
        "wz": np.zeros(60),
    }
    log = Telemetry.read(written(tmp_path, columns))
    inner = np.r_[1:29, 31:59]
    assert np.allclose(column(log, "ax")[inner], (sign * 2.0 * t)[inner])
    # One-sided at the ends of a run: slope of the chord, not the jump to the other run.
    assert column(log, "ax")[30] == pytest.approx(-(t[31] + t[30]))
    assert column(log, "ax")[29] == pytest.approx(t[29] + t[28])


def test_gravity_of_a_log_follows_rep_103(tmp_path: Path) -> None:
    columns = table() | {"pitch": np.full(60, 0.3), "roll": np.full(60, -0.2)}
    log = Telemetry.read(written(tmp_path, columns))
    g = STANDARD_GRAVITY
    # Nose down: gravity pulls forward. Left side down (roll < 0): gravity pulls to the left.
    assert column(log, "gravity_x")[5] == pytest.approx(g * math.sin(0.3))
    assert column(log, "gravity_y")[5] == pytest.approx(g * math.cos(0.3) * math.sin(0.2))
    assert column(log, "gravity_normal")[5] == pytest.approx(g * math.cos(0.3) * math.cos(0.2))
    assert not any("flat" in sentence for sentence in log.assumed)


def test_slope_rate_is_the_pitch_rate_on_a_rising_ramp(tmp_path: Path) -> None:
    columns = table(runs=1)
    columns |= {"pitch": -0.1 * columns["time"] / 6.0}
    log = Telemetry.read(written(tmp_path, columns))
    assert np.allclose(column(log, "slope_rate"), 0.1 / 6.0)


def test_odometer_runs_on_and_time_starts_anew_with_a_run(tmp_path: Path) -> None:
    columns = table() | {"vx": np.full(60, 0.3), "vy": np.full(60, 0.4), "wz": np.zeros(60)}
    log = Telemetry.read(written(tmp_path, columns))
    assert column(log, "odometer")[-1] == pytest.approx(60 * 0.05)
    assert column(log, "time_since_start")[[0, 29, 30, 59]] == pytest.approx([0.1, 3.0, 0.1, 3.0])
    assert log.energy_by_run["run 1"] == pytest.approx(0.1 * log.power[30:].sum())


def test_power_from_voltage_and_current(tmp_path: Path) -> None:
    columns = table()
    columns["battery_voltage"] = np.full(60, 24.0)
    columns["battery_current"] = columns.pop("power") / 24.0
    log = Telemetry.read(written(tmp_path, columns))
    assert np.allclose(log.power, table()["power"])
    assert any(s.startswith("power: battery_voltage") for s in log.derived)
    assert ("unknown", "power") not in kinds(log)


def test_unknown_quantities_stay_unknown_and_labels_are_kept(tmp_path: Path) -> None:
    columns = table() | {
        "surface": ["gravel"] * 20 + ["brown"] * 40,
        "motor_temp": [""] * 10 + list(np.linspace(20.0, 40.0, 50)),
        "wheel_current_1": np.linspace(0.0, 1.0, 60),
        "wheel_current_3": np.linspace(1.0, 2.0, 60),
    }
    log = Telemetry.read(written(tmp_path, columns))
    assert np.isnan(column(log, "motor_temp")[:10]).all()
    assert ("unknown", "motor_temp") in kinds(log)
    assert log.surfaces == ("gravel", "brown")
    assert log.wheel_currents is not None
    assert log.wheel_currents.shape == (60, 3)
    assert np.isnan(log.wheel_currents[:, 1]).all()
    renumbered = log.rows_for(["brown", "sand"])[:, INDEX["surface"]]
    assert np.array_equal(renumbered, np.repeat([-1.0, 0.0], [20, 40]))


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


def test_a_mapping_adapts_names_units_and_signs(tmp_path: Path) -> None:
    columns = table(runs=1)
    foreign = {
        "stamp": columns["time"] * 1e3,
        "Vel X [mm/s]": columns["vx"] * 1e3,
        "left": -columns["vy"],
        "yaw": np.degrees(columns["wz"]),
        "P": -columns["power"] / 1e3,
        "T": np.full(60, 68.0),
    }
    (tmp_path / "map.toml").write_text(
        """
        power_at = "source"
        [columns]
        stamp = { quantity = "time", unit = "ms" }
        "Vel X [mm/s]" = { quantity = "vx", unit = "mm/s" }
        left = { quantity = "vy", sign = -1 }
        yaw = { quantity = "wz", unit = "deg/s" }
        P = { quantity = "power", unit = "kW", sign = -1 }
        T = { quantity = "ambient_temp", unit = "°F" }
        [constants]
        run = "yard"
        payload = { value = 2, unit = "lb" }
        """,
        encoding="utf-8",
    )
    log = Telemetry.read(written(tmp_path, foreign), tmp_path / "map.toml")
    assert log.power_at == "source"
    assert np.allclose(column(log, "vx"), columns["vx"])
    assert np.allclose(column(log, "vy"), columns["vy"])
    assert np.allclose(column(log, "wz"), columns["wz"])
    assert np.allclose(log.power, columns["power"])
    assert np.allclose(column(log, "ambient_temp"), 20.0)  # 68 °F
    assert np.allclose(column(log, "payload"), 0.90718474)  # the pound of 1959


BAD_MAPPINGS = {
    "unknown key": "unit = 3",
    "not TOML": "columns = [",
    "unknown quantity": '[columns]\nvx = "vel_x"',
    "other dimension": '[columns]\nvx = {quantity="vx", unit="kg"}',
    "no unit": '[columns]\nvx = {quantity="vx", unit="blorp"}',
    "code as unit": '[columns]\nvx = {quantity="vx", unit="__import__(\'os\')"}',
    "sign 0": '[columns]\nvx = {quantity="vx", sign=0}',
    "column not there": '[columns]\nvelocity = "vx"',
    "twice": '[columns]\nvx = "vy"\nvy = "vy"',
    "place": 'power_at = "wall"',
    "constant text": '[constants]\npayload = "2"',
    "constant inf": "[constants]\npayload = inf",
    "constant of 400 digits": f"[constants]\npayload = {'1' * 400}",
    "constant of 5000 digits": f"[constants]\npayload = {'1' * 5000}",
    "constant of 400 digits and a unit": (
        f'[constants]\npayload = {{value={"1" * 400}, unit="lb"}}'
    ),
    "constant too large in SI": '[constants]\npayload = {value=1e308, unit="Gg"}',
    "sign of 400 digits": f'[columns]\nvx = {{quantity="vx", sign={"1" * 400}}}',
    "sign of 5000 hexadecimal digits": (f'[columns]\nvx = {{quantity="vx", sign=0x{"f" * 5000}}}'),
    "interval of 400 digits": f"[rosbag]\ninterval = {'1' * 400}",
    "nested": f"a = {'[' * 20_000}",
    "label with unit": '[columns]\nrun = {quantity="run", unit="m"}',
    "interval": "[rosbag]\ninterval = 0",
    "column and constant": '[columns]\nvx = "vx"\n[constants]\nvx = 2',
}


@pytest.mark.parametrize("name", BAD_MAPPINGS)
def test_a_bad_mapping_is_one_clear_sentence(tmp_path: Path, name: str) -> None:
    (tmp_path / "map.toml").write_text(BAD_MAPPINGS[name])
    with pytest.raises(LogError, match=r"map\.toml.*; accepted: ") as caught:
        Telemetry.read(written(tmp_path, table()), tmp_path / "map.toml")
    assert "\n" not in str(caught.value)


# Hostile and broken logs: refused.


def changed(**columns: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        result = table() | columns
        return written(folder, {k: v for k, v in result.items() if v is not None})

    return write


def as_bytes(content: bytes, name: str = "log.csv") -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return write


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


def spoilt(name: str, row: int, value: Any) -> list[Any]:
    values: list[Any] = list(table()[name])
    values[row] = value
    return values


BACK = table()["time"].copy()
BACK[17] = 0.35
LATER = table(runs=1)["time"]
AGAIN = ["a"] * 20 + ["b"] * 20 + ["a"] * 20
SOUND = text(table())
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
    "missing column": (changed(power=None), "no column 'power'"),
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
    "text in time": (changed(time=[f"12:00:{k:02d}" for k in range(60)]), "'time'.*row 1"),
    "nothing measured": (changed(power=[""] * 60), "none of its 60 rows.*60 have no value"),
    "all infinite": (changed(vx=[math.inf] * 60), "none of its 60 rows"),
    "time runs back": (changed(time=BACK), r"backwards.*row 18.*'run 0'"),
    "runs mixed": (changed(run=AGAIN, time=LATER), "run 'a' are not consecutive.*row 41"),
    "speed in mm/s": (changed(vx=table()["vx"] * 1e3), "vx: 60 of 60.*mm/s"),
    "pitch in degrees": (changed(pitch=np.linspace(-9.0, 9.0, 60)), "pitch.*degrees"),
    "temperature in kelvin": (changed(ambient_temp=np.full(60, 293.0)), "ambient_temp.*kelvin"),
    "power in µW": (changed(power=table()["power"] * 1e6), "power: 60 of 60"),
    "time in ms": (changed(time=table()["time"] * 1e4), "time.*not s"),
    "time in ns since 1970": (changed(time=1.7e18 + table()["time"] * 1e9), "time.*ns"),
    "power negative": (changed(power=-table()["power"]), "power.*negative in 60 of 60.*sign = -1"),
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


# Odd logs: read, with a report of what was left out or looks wrong.

GAPPED = table(runs=1)["time"] + np.where(np.arange(60) > 30, 7.0, 0.0)
DOUBLED = table()["time"].copy()
DOUBLED[[5, 40]] = DOUBLED[[4, 39]]
ODD: dict[str, tuple[Callable[[Path], Path], tuple[str, str], int]] = {
    "empty cells": (changed(power=spoilt("power", 3, "")), ("missing", "power"), 59),
    "NaN": (changed(vx=spoilt("vx", 3, math.nan)), ("missing", "vx"), 59),
    "infinity": (changed(vx=spoilt("vx", 3, math.inf)), ("missing", "vx"), 59),
    "1e999": (changed(wz=spoilt("wz", 3, "1e999")), ("missing", "wz"), 59),
    "no label": (changed(run=spoilt("run", 3, "")), ("missing", "run"), 59),
    "pitch lost": (changed(pitch=[0.0, 0.1, "", *[0.02] * 57]), ("missing", "pitch"), 59),
    "wind lost": (changed(wind_x=[1.0, 2.0, "", *[3.0] * 57]), ("filled", "wind_x"), 60),
    "doubled samples": (changed(time=DOUBLED), ("doubled", "time"), 58),
    "gap": (changed(run=["a"] * 60, time=GAPPED), ("gap", "time"), 60),
    "slow seconds": (changed(time=table()["time"] * 200), ("unit", "time"), 60),
    "one-row run": (changed(run=["a"] * 59 + ["b"], time=LATER), ("one-row run", "run"), 60),
    "one-row runs": (changed(run=[f"{k}" for k in range(60)]), ("one-row run", "run"), 60),
    "constant": (changed(vy=np.zeros(60)), ("constant", "vy"), 60),
    "constant power": (changed(power=np.full(60, 9.0)), ("constant", "power"), 60),
    "clipped": (changed(power=np.minimum(table()["power"], 46.0)), ("clipped", "power"), 60),
    "braking cut off": (
        changed(power=np.maximum(table()["power"] - 47.0, 0.0)),
        ("clipped", "power"),
        60,
    ),
    "kW": (changed(power=table()["power"] / 1e3), ("unit", "power"), 60),
    "sign": (
        changed(power=np.where(np.arange(60) % 5, -1.0, 1.0) * table()["power"]),
        ("sign", "power"),
        60,
    ),
    "two meters": (
        changed(battery_voltage=np.full(60, 24.0), battery_current=table()["power"] / 48.0),
        ("disagrees", "power"),
        60,
    ),
    "repeated values": (
        changed(**{k: np.repeat(table()[k][::2], 2) for k in ("vx", "vy", "wz", "power")}),
        ("repeated", ""),
        60,
    ),
    "unknown column": (changed(Roll=np.zeros(60)), ("not used", "Roll"), 60),
    "byte-order mark": (as_bytes(b"\xef\xbb\xbf" + SOUND.encode()), ("format", ""), 60),
    "semicolons and commas": (as_bytes(text(table(), ";", ",").encode()), ("format", ""), 60),
    "comments above": (as_bytes(b"# robot 7\n# yard\n" + SOUND.encode()), ("format", ""), 60),
    "tabs": (as_bytes(text(table(), "\t").encode()), ("format", ""), 60),
    "gzip": (as_bytes(gzip.compress(SOUND.encode()), "log.csv.gz"), ("format", ""), 60),
    "power cut in the last line": (as_bytes(SOUND.encode() + b"run 1,3.1"), ("ragged", ""), 60),
}


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


def test_one_hundred_thousand_rows_take_less_than_half_a_second(tmp_path: Path) -> None:
    columns = table(100_000, runs=200)
    path = written(tmp_path, columns | {"pitch": 0.1 * columns["vy"], "surface": ["a"] * 100_000})
    best = math.inf
    for _ in range(3):
        begin = clock.perf_counter()
        assert len(Telemetry.read(path)) == 100_000
        best = min(best, clock.perf_counter() - begin)
    assert best < 0.5


def test_timestamps_and_labels_of_parquet(tmp_path: Path) -> None:
    columns = table()
    columns["time"] = pa.array((columns["time"] * 1000).astype(int), pa.timestamp("ms"))
    columns["run"] = pa.array(columns["run"]).dictionary_encode()
    columns["vx"] = pa.array(columns["vx"], pa.float32())
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    log = Telemetry.read(tmp_path / "log.parquet")
    assert log.time[:2] == pytest.approx([0.1, 0.2])
    assert log.run_names == ("run 0", "run 1")
    assert log.report == ()


# Logs measured by others.


def foreign(name: str) -> Path:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{name} is not part of the project and is not here")
    return path


def test_robotino_log() -> None:
    log = Telemetry.read(foreign("robotino/robotino_two_floors.csv"))
    assert len(log.run_names) == 288
    assert set(log.surfaces) == {"brown", "gray"}
    assert log.wheel_currents is not None
    assert log.wheel_currents.shape == (len(log), 3)
    assert np.allclose(log.interval, 1.0)
    # Steady runs: what is derived is small against the 0.1 m/s in one second of a start.
    assert np.median(np.abs(column(log, "ax"))) < 0.02


@pytest.mark.parametrize("name", ["contact_plain.csv", "contact_payload.csv"])
def test_contact_log(name: str) -> None:
    log = Telemetry.read(foreign(f"contact/{name}"))
    assert len(log.run_names) == 12
    # Accelerations were logged as well; the derived ones agree up to the noise of the channels.
    assert {"ax", "ay", "roll", "pitch", "com_x"} <= log.present
    assert log.interval == pytest.approx(0.2)
    change = np.gradient(column(log, "vx")[:250], 0.2)
    derived = change - column(log, "wz")[:250] * column(log, "vy")[:250]
    assert np.corrcoef(derived, column(log, "ax")[:250])[0, 1] > 0.9


def test_a_recording(tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds_of = store.types
    vector, stamp = kinds_of["geometry_msgs/msg/Vector3"], kinds_of["builtin_interfaces/msg/Time"]
    header = kinds_of["std_msgs/msg/Header"](stamp(0, 0), "base_link")
    quaternion = kinds_of["geometry_msgs/msg/Quaternion"]
    pose = kinds_of["geometry_msgs/msg/Pose"](
        kinds_of["geometry_msgs/msg/Point"](0.0, 0.0, 0.0), quaternion(0.0, 0.0, 0.0, 1.0)
    )
    nothing = np.zeros(36)
    pitch = 0.2

    def odometry(t: float) -> Any:
        twist = kinds_of["geometry_msgs/msg/Twist"](
            vector(0.5 * t, 0.1, 0.0), vector(0.0, 0.0, 0.3)
        )
        return kinds_of["nav_msgs/msg/Odometry"](
            header,
            "base_link",
            kinds_of["geometry_msgs/msg/PoseWithCovariance"](pose, nothing),
            kinds_of["geometry_msgs/msg/TwistWithCovariance"](twist, nothing),
        )

    def imu(t: float) -> Any:
        felt = vector(0.5 - STANDARD_GRAVITY * math.sin(pitch), 0.0, 9.6)
        return kinds_of["sensor_msgs/msg/Imu"](
            header,
            quaternion(0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2)),
            np.zeros(9),
            vector(0.0, 0.0, 0.3),
            np.zeros(9),
            felt,
            np.zeros(9),
        )

    battery_kind = kinds_of["sensor_msgs/msg/BatteryState"]

    def battery(t: float) -> Any:
        lists = np.zeros(0, np.float32)
        current = -2.0
        return battery_kind(
            header, 24.0, 20.0, current, 1.0, 5.0, 5.0, 0.9, 2, 1, 1, True, lists, lists, "", ""
        )

    path = tmp_path / "drive"
    topics = (
        ("/odom", "nav_msgs/msg/Odometry", 50, odometry),
        ("/imu", "sensor_msgs/msg/Imu", 100, imu),
        ("/battery", "sensor_msgs/msg/BatteryState", 5, battery),
    )
    with rosbag2.Writer(path, version=9) as writer:
        for topic, kind, rate, make in topics:
            connection = writer.add_connection(topic, kind, typestore=store)
            for k in range(4 * rate):
                t = k / rate
                raw = store.serialize_cdr(make(t), kind)
                writer.write(connection, int(1e9 * t), raw)
    log = Telemetry.read(path)
    assert log.run_names == ("drive",)
    assert np.allclose(log.interval, 0.1)
    assert np.allclose(log.power, 48.0)
    # Five messages of 50 Hz in an interval that ends at t have their mean 0.06 s before it.
    assert np.allclose(column(log, "vx"), 0.5 * (log.time - 0.06), atol=0.011)
    assert np.allclose(column(log, "ax"), 0.5)
    assert np.allclose(column(log, "gravity_x"), STANDARD_GRAVITY * math.sin(pitch))
    file = next(path.glob("*.db3"))
    (tmp_path / "map.toml").write_text('[rosbag]\nodometry = "/elsewhere"\n')
    with pytest.raises(LogError, match="no such topic"):
        Telemetry.read(path, tmp_path / "map.toml")
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(LogError, match="cannot be read"):
        Telemetry.read(path)
