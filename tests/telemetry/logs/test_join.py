"""Files of one drive with their own clocks and rates, joined to the log that was driven."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.arrays import Array
from planner.errors import LogError
from planner.power.kinematics import RIM
from planner.power.vehicles import load_vehicle
from planner.telemetry.logs.join import JoinedLog, join_logs
from planner.telemetry.logs.log import Telemetry
from planner.telemetry.virtual import Noise, VirtualRobot

SECONDS = 120
EPOCH = 1.76e9
FINE = 1000  # Hz of the true course


def course() -> dict[str, Array]:
    """The true drive, (SECONDS·FINE,) values: smooth random speeds, and the power they take."""
    random = np.random.default_rng(4)
    time = np.arange(SECONDS * FINE) / FINE
    marks = np.arange(0.0, SECONDS + 4.0, 4.0)

    def smooth(size: float) -> Array:
        return np.interp(time, marks, random.uniform(-size, size, len(marks)))

    vx, vy, wz = smooth(0.8), smooth(0.4), smooth(0.5)
    power = 6.0 + 30.0 * np.abs(vx) + 45.0 * np.abs(vy) + 4.0 * np.abs(wz)
    return {"time": time, "vx": vx, "vy": vy, "wz": wz, "power": power, "pitch": smooth(0.05)}


TRUE = course()


def mean(name: str, ends: Array, length: float) -> Array:
    """True means over (end - length, end]."""
    sums = np.append(0.0, np.cumsum(TRUE[name]))
    last = np.clip(np.rint(ends * FINE).astype(int), 0, len(sums) - 1)
    first = np.clip(np.rint((ends - length) * FINE).astype(int), 0, len(sums) - 1)
    return (sums[last] - sums[first]) / np.maximum(last - first, 1)


def write(path: Path, ends: Array, length: float, names: str, clock: float = 0.0) -> Path:
    """A file of true means over intervals, its times on a clock of its own."""
    columns = [ends + clock, *(mean(name, ends, length) for name in names.split())]
    rows = [",".join(["time", *names.split()])]
    rows += [",".join(f"{value:.12g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join(rows) + "\n")
    return path


def every(length: float, first: float = 0.0) -> Array:
    """Ends of intervals from ``first`` on."""
    return np.arange(first + length, SECONDS, length)


def right(joined: JoinedLog, start: float, *, of: float = 0.02) -> None:
    """The rows are the true means over their own intervals."""
    ends = joined.columns["time"] + start
    for name in ("vx", "vy", "wz", "power"):
        true = mean(name, ends, joined.interval)
        inside = slice(1, -1)
        spread = float(np.std(true))
        error = np.sqrt(np.mean((joined.columns[name] - true)[inside] ** 2))
        assert error < of * spread, name


def test_three_files_with_one_clock(tmp_path: Path) -> None:
    files = [
        write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH),
        write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH),
        write(tmp_path / "imu.csv", every(0.01), 0.01, "pitch", EPOCH),
    ]
    joined = join_logs(files)
    assert joined.interval == pytest.approx(0.5)
    right(joined, 0.5)
    said = "\n".join(joined.said)
    assert "rows of 0.5 s, the samples of power.csv" in said
    assert "averaged: vx (odom.csv, 50 Hz)" in said
    assert "pitch (imu.csv, 100 Hz)" in said
    assert "taken as sampled: power (power.csv, 2 Hz)" in said
    assert not joined.findings
    joined.write(tmp_path / "drive.csv")
    log = Telemetry.read(tmp_path / "drive.csv")
    assert len(log) == len(joined.columns["time"])
    assert np.allclose(log.power, joined.columns["power"], rtol=1e-6)
    assert np.allclose(log.interval, 0.5)


@pytest.mark.parametrize("shift", [-7.4, 2.3, 12.0])
def test_a_clock_of_its_own_is_found(tmp_path: Path, shift: float) -> None:
    files = [
        write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH),
        write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH + shift),
    ]
    joined = join_logs(files)
    (sentence,) = [one for one in joined.said if "shifted" in one]
    assert float(sentence.split("by ")[1].split(" s")[0]) == pytest.approx(-shift, abs=0.06)
    right(joined, 0.5, of=0.15)


@pytest.mark.parametrize("seed", [3, 5])
def test_power_that_leads_the_speed_does_not_mislead(tmp_path: Path, seed: int) -> None:
    """A robot draws most while it speeds up: by the speed alone its meter seems 0.5 s early."""
    robot = VirtualRobot("minibalance", seed=seed)
    profile = robot.profile("rich", runs=3, rows=1500, row=0.1)
    columns = robot.drive(profile, noise=Noise(level=0.02)).columns
    first = columns["run"] == columns["run"][0]
    time = EPOCH + np.asarray(columns["time"], float)[first]

    def keep(name: str, stamps: Array, **values: Array) -> Path:
        table = np.column_stack([stamps, *values.values()])
        heading = ",".join(["time", *values])
        np.savetxt(tmp_path / name, table, delimiter=",", header=heading, comments="", fmt="%.15g")
        return tmp_path / name

    speeds = {name: np.asarray(columns[name], float)[first] for name in ("vx", "vy", "wz")}
    angles = {name: np.asarray(columns[name], float)[first] for name in ("pitch", "roll")}
    power = np.asarray(columns["power"], float)[first].reshape(-1, 5).mean(axis=1)
    files = [
        keep("odom.csv", time, **speeds),
        keep("power.csv", time[4::5] + 3.37, power=power),
        keep("imu.csv", time, **angles),
    ]
    (sentence,) = [one for one in join_logs(files).said if "power.csv shifted" in one]
    assert float(sentence.split("by ")[1].split(" s")[0]) == pytest.approx(-3.37, abs=0.25)
    with_own_clock = [files[0], keep("power.csv", time[4::5], power=power), files[2]]
    assert "power.csv not shifted against odom.csv" in join_logs(with_own_clock).said


def test_angles_alone_tell_no_shift(tmp_path: Path) -> None:
    odometry = write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH)
    power = write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH)
    angles = write(tmp_path / "imu.csv", every(0.01), 0.01, "pitch", EPOCH + 2.0)
    said = join_logs([odometry, power, angles]).said
    assert "imu.csv not shifted against odom.csv; pitch cannot tell a shift" in said
    foreign = write(tmp_path / "imu.csv", every(0.01), 0.01, "pitch")
    with pytest.raises(LogError) as caught:
        join_logs([odometry, power, foreign])
    assert str(caught.value) == (
        "imu.csv: shares no clock with odom.csv, and pitch cannot tell the shift; accepted: wz, "
        "speeds or power in this file, or the shift in s, --shift imu.csv=SECONDS"
    )
    shifts = {"imu.csv": EPOCH}
    right(join_logs([odometry, power, foreign], shifts=shifts), 0.5)


def test_a_file_that_counts_from_its_own_start(tmp_path: Path) -> None:
    odometry = write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH)
    power = write(tmp_path / "power.csv", every(0.5, 20.0), 0.5, "power", -20.0)
    joined = join_logs([odometry, power])
    right(joined, 20.5, of=0.15)
    by_hand = join_logs([odometry, power], shifts={"power.csv": EPOCH + 20.0})
    right(by_hand, 20.5)
    assert "as given" in " ".join(by_hand.said)


def test_stamps_in_nanoseconds(tmp_path: Path) -> None:
    ends = every(0.02)
    odometry = write(tmp_path / "odom.csv", ends, 0.02, "vx vy wz")
    lines = odometry.read_text().splitlines()
    stamps = [str(int(EPOCH) * 10**9 + round(end * 1e9)) for end in ends]
    rows = [f"{s},{line.partition(',')[2]}" for s, line in zip(stamps, lines[1:], strict=True)]
    odometry.write_text("\n".join([lines[0], *rows]))
    power = write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH)
    right(join_logs([odometry, power]), 0.5)


def test_two_runs_in_one_file_are_no_drive(tmp_path: Path) -> None:
    """Joined, their times would run backwards, and no reader would take the log."""
    power = write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH)
    odometry = write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH)
    head, *rows = odometry.read_text().splitlines()
    odometry.write_text("\n".join([head, *rows, *rows]))
    with pytest.raises(LogError, match=f"backwards by .* in row {len(rows) + 1}"):
        join_logs([odometry, power])
    # A buffer may write a sample late; that one is left out.
    odometry.write_text("\n".join([head, *rows[:50], rows[20], *rows[50:]]))
    joined = join_logs([odometry, power])
    assert "odom.csv: 1 rows without a later time left out" in joined.findings
    right(joined, 0.5)


def test_a_small_shift_is_left_to_the_diagnosis(tmp_path: Path) -> None:
    # A meter that lags 0.3 s is a sensor to be diagnosed, not a clock to be set.
    files = [
        write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH),
        write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH + 0.3),
    ]
    assert "power.csv not shifted against odom.csv" in join_logs(files).said


def test_held_power_is_found_and_taken_at_its_updates(tmp_path: Path) -> None:
    odometry = write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH)
    updates, slow = every(0.5), mean("power", every(0.5), 0.5)
    time = np.arange(0.5, SECONDS - 0.5, 0.02)
    held = slow[np.searchsorted(updates, time + 1e-9, side="right") - 1]
    rows = [f"{EPOCH + t:.12g},{p:.9g}" for t, p in zip(time, held, strict=True)]
    (tmp_path / "power.csv").write_text("\n".join(["time,power", *rows]))
    joined = join_logs([odometry, tmp_path / "power.csv"])
    (finding,) = joined.findings
    assert finding.startswith("power.csv: power is held: sampled every 0.02 s, new every 0.5 s")
    assert joined.interval == pytest.approx(0.5, abs=0.021)
    right(joined, 0.5, of=0.05)


def merged(path: Path, files: list[Path]) -> Path:
    """One table of several files, as tools write that export a recording: a row for each sample."""
    rows: dict[float, dict[str, str]] = {}
    names: list[str] = []
    for file in files:
        heading, *lines = (line.split(",") for line in file.read_text().splitlines())
        names += heading[1:]
        for line in lines:
            rows.setdefault(float(line[0]), {}).update(zip(heading[1:], line[1:], strict=True))
    text = [",".join(["time", *names])]
    text += [
        ",".join([f"{time:.12g}", *(row.get(name, "") for name in names)])
        for time, row in sorted(rows.items())
    ]
    path.write_text("\n".join(text))
    return path


def test_a_table_of_several_topics_is_what_their_files_are(tmp_path: Path) -> None:
    files = [
        write(tmp_path / "odom.csv", every(0.1), 0.1, "vx vy wz", EPOCH),
        write(tmp_path / "imu.csv", every(0.1, first=0.03), 0.1, "pitch", EPOCH),
        write(tmp_path / "power.csv", every(0.5, first=0.003), 0.5, "power", EPOCH),
    ]
    joined = join_logs([merged(tmp_path / "all.csv", files)])
    right(joined, 0.503)
    apart = join_logs(files).columns
    assert all(np.array_equal(joined.columns[name], apart[name]) for name in apart)
    # A table in which every row has speeds and each tenth has power is one as well.
    slow = write(tmp_path / "slow.csv", every(1.0), 1.0, "power", EPOCH)
    joined = join_logs([merged(tmp_path / "sparse.csv", [files[0], slow])])
    assert joined.interval == pytest.approx(1.0)
    right(joined, 1.0)


def test_topics_of_one_table_share_its_clock(tmp_path: Path) -> None:
    odometry = write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH)
    topics = [
        write(tmp_path / "imu.csv", every(0.1, first=0.03), 0.1, "pitch", EPOCH + 7.0),
        write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH + 7.0),
    ]
    joined = join_logs([odometry, merged(tmp_path / "other.csv", topics)])
    assert any(said.startswith("other.csv shifted by -7.0") for said in joined.said)
    ends = joined.columns["time"] + 0.5
    true = mean("pitch", ends, 0.5)
    assert np.std((joined.columns["pitch"] - true)[2:-2]) < 0.05 * np.std(true)


@pytest.mark.parametrize("name", ["minibalance", "robotino"])
def test_wheel_speeds_become_body_velocities(tmp_path: Path, name: str) -> None:
    vehicle = load_vehicle(name)
    ends = every(0.05)
    body = np.column_stack([mean(v, ends, 0.05) for v in ("vx", "vy", "wz")])
    wheels = body @ vehicle.layout.table[:, RIM : RIM + 3].T / vehicle.layout.radius
    names = [f"wheel_speed_{k + 1}" for k in range(wheels.shape[1])]
    rows = [
        ",".join(f"{v:.12g}" for v in (EPOCH + t, *w)) for t, w in zip(ends, wheels, strict=True)
    ]
    path = tmp_path / "wheels.csv"
    path.write_text("\n".join([",".join(["time", *names]), *rows]))
    power = write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH)
    joined = join_logs([path, power], vehicle=vehicle)
    right(joined, 0.5)
    assert not joined.findings
    with pytest.raises(LogError, match=r"has wheel speeds.*the vehicle"):
        join_logs([path, power])
    # The same in rpm, by a mapping file and without one.
    turned = np.column_stack([EPOCH + ends, wheels * 60.0 / (2.0 * np.pi)])
    rpm = tmp_path / "rpm.csv"
    names_of = [f"n{k + 1}" for k in range(wheels.shape[1])]
    np.savetxt(
        rpm, turned, fmt="%.15g", delimiter=",", header=",".join(["time", *names_of]), comments=""
    )
    columns = {n: {"quantity": q, "unit": "rpm"} for n, q in zip(names_of, names, strict=True)}
    joined = join_logs([rpm, power], vehicle=vehicle, mapping={"columns": columns})
    right(joined, 0.5)
    assert not joined.findings
    rpm.write_text("\n".join([",".join(["time", *names]), *rpm.read_text().splitlines()[1:]]))
    (finding,) = join_logs([rpm, power], vehicle=vehicle).findings
    assert "wheel speeds taken as rad/s give" in finding
    assert "rpm" in finding
    if vehicle.layout.wheel_count > 3:
        # Front and rear left exchanged; the two front wheels would be another motion instead.
        text = path.read_text().replace("wheel_speed_1,", "rear,", 1)
        text = text.replace("wheel_speed_3,", "wheel_speed_1,", 1)
        path.write_text(text.replace("rear,", "wheel_speed_3,", 1))
        assert "disagree with each other" in join_logs([path, power], vehicle=vehicle).findings[0]


def test_shorter_rows_hold_and_say_so(tmp_path: Path) -> None:
    files = [
        write(tmp_path / "odom.csv", every(0.02), 0.02, "vx vy wz", EPOCH),
        write(tmp_path / "power.csv", every(0.5), 0.5, "power", EPOCH),
    ]
    joined = join_logs(files, interval=0.1)
    assert joined.interval == 0.1
    assert "held: power (power.csv, 2 Hz)" in joined.said
    assert "a sample every 0.5 s is held over several rows" in joined.findings[0]


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"a.csv": "time,vx,vy,wz\n0,0,0,0\n1,0,0,0\n2,1,0,0\n"}, ["'power'", "battery_voltage"]),
        ({"a.csv": "vx,vy\n0,0\n"}, ["no column 'time'"]),
        ({"a.csv": "time,colour\n0,1\n1,2\n"}, ["no column that a log may have"]),
        ({"a.csv": "time,vx\n1,0\n1,0\n"}, ["no two rows of increasing time"]),
        ({"a.csv": "time,wheel_speed_1\n0,0\n1,0\n"}, ["has 1 wheel speeds", "wheel_speed_4"]),
        (
            {
                "a.csv": "time,vx,vy,wz\n0,0,0,0\n1,0,0,0\n2,1,0,0\n3,0,0,0\n",
                "b.csv": "time,power\n1760000000,5\n1760000001,5\n1760000002,5\n",
            },
            ["b.csv", "shares no clock with a.csv", "--shift b.csv=SECONDS"],
        ),
        (
            {
                "a.csv": "time,vx,vy,wz\n0,0,0,0\n1,0,0,0\n2,1,0,0\n3,0,0,0\n",
                "b.csv": "time,power\n100,5\n101,5\n102,5\n",
            },
            ["b.csv", "clock"],
        ),
        ({"a.txt": "nothing"}, ["accepted"]),
    ],
)
def test_what_cannot_be_joined(tmp_path: Path, files: dict[str, str], words: list[str]) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(LogError) as caught:
        join_logs([tmp_path / name for name in files], vehicle=load_vehicle("minibalance"))
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)
