"""Whether a log belongs together: its runs, its power with its motion, its motion with the robot.

    apart(log, residual, model)     # what runs and power say, in sentences
    source = source.with_findings(beyond_motors(source.sample, model))

None of these names an effect. What changes from run to run without a column may be a load, a
battery or another floor. A power that does not follow the motion may have another clock or unit,
and a motion that the motors cannot give is that of another robot, or in another unit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.amounts import share as in_per_cent
from planner.amounts import watts
from planner.arrays import Array
from planner.power.kinematics import RIM
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle
from planner.quantities import INDEX
from planner.telemetry.logs import Finding, Telemetry
from planner.telemetry.noise import deviation
from planner.telemetry.prediction import predict

BEYOND_MOTORS = TOO_FAST, TOO_STRONG, TOO_WEAK = "too fast", "too strong", "too weak"
"""Kinds of findings that another unit or another robot explains."""
LEAST_RUNS_APART = 6
"""Runs below which nothing is said about how they differ."""
LEAST_RUN_ROWS = 8
"""Rows of a run whose halves are compared."""
LEAST_SHARE_APART = 0.4
"""Share of the squared error that runs must differ by: usual errors of a weighed load differ from
run to run, too."""
LEAST_OF_POWER = 0.05
"""Share of the mean power that they must differ by."""
LEAST_HALVES_Z = 2.33
"""Standard errors of the correlation of the halves: a chance of one in a hundred."""
LOAD = 0.05
"""Share of the robot's mass, small enough that its power is as large per kilogram as that of any
load."""
FAR = 10.0
"""Deviations at which a row counts no more: one outlier is no run."""
VARYING = 0.2
"""Deviation over mean of a power that varies."""
LEAST_EXPLAINED_POWER = 0.5
"""Share of that variation which a model of the robot explains."""
LEAST_ROWS = 40
"""Rows below which such shares say nothing."""
FULL_BATTERY = 1.3
"""Voltage of a full battery over its nominal one, with the tolerance of a torque constant."""
MOST_TOO_FAST = 0.01
"""Share of rows that may be faster than the motors: rolling down, or an outlier."""
LEAST_OF_ELECTRONICS, NEARLY_ALL = 0.1, 0.99
"""Share of the stated power of the electronics, and quantile of the rows that stay below it."""
MOST_TOO_STRONG = 0.5
"""Share of rows that may have more power than the motors at a standstill: an arm or a heater."""


def apart(log: Telemetry, residual: Array, model: PowerModel) -> tuple[str, ...]:
    """What speaks against a log that lacks nothing: clauses, none where all belongs together.

    Args:
        log: the rows.
        residual: (n,) W, measured less modelled; on held-out runs where the model was fitted.
        model: what it is left by.
    """
    return (*_runs(log, residual, model), *_power(log, residual))


def beyond_motors(log: Telemetry, model: PowerModel) -> tuple[Finding, ...]:
    """A motion or a power that the motors of the model's vehicle cannot have."""
    vehicle = model.vehicle
    stated = "battery.voltage" not in vehicle.provenance.defaults_taken
    volts = FULL_BATTERY * (vehicle.battery.voltage if stated else vehicle.limits.voltage)
    return (
        *_too_fast(log, vehicle, volts),
        *_too_strong(log, vehicle, volts),
        *_too_weak(log, vehicle),
    )


def impossible(log: Telemetry) -> tuple[str, ...]:
    """What ``beyond_motors`` found in a log, in sentences."""
    return tuple(finding.sentence for finding in log.report if finding.kind in BEYOND_MOTORS)


def _too_strong(log: Telemetry, vehicle: Vehicle, volts: float) -> Iterator[Finding]:
    electronics = vehicle.parameters["electronics"]["power"]
    stalled = volts**2 / vehicle.parameters["copper_loss"]["resistance"]
    most = electronics + vehicle.layout.wheel_count * stalled
    many = int(np.count_nonzero(np.abs(log.power) > most))
    if many > MOST_TOO_STRONG * len(log):
        said = (
            f"power: {in_per_cent(many / len(log))} of the rows have more than the {most:.3g} W "
            f"that {vehicle.name} takes with all motors at a standstill and a full battery: "
            "another unit, such as mW, or another robot"
        )
        yield Finding(TOO_STRONG, "power", many, said)


def _too_weak(log: Telemetry, vehicle: Vehicle) -> Iterator[Finding]:
    least = LEAST_OF_ELECTRONICS * vehicle.parameters["electronics"]["power"]
    if len(log) and float(np.quantile(np.abs(log.power), NEARLY_ALL)) < least:
        many = int(np.count_nonzero(np.abs(log.power) < least))
        said = (
            f"power: {in_per_cent(many / len(log))} of the rows have less than {least:.2g} W, a "
            f"tenth of what the electronics of {vehicle.name} take: another unit, such as kW, or "
            "another robot"
        )
        yield Finding(TOO_WEAK, "power", many, said)


def _too_fast(log: Telemetry, vehicle: Vehicle, volts: float) -> Iterator[Finding]:
    constant = vehicle.parameters["copper_loss"]["torque_constant"]
    fastest = volts / constant / vehicle.gear_ratio * vehicle.layout.radius
    motion = log.rows[:, [INDEX[name] for name in ("vx", "vy", "wz")]]
    rims = np.abs(motion @ vehicle.layout.table[:, RIM : RIM + 3].T).max(axis=1, initial=0.0)
    many = int(np.count_nonzero(rims > fastest))
    if many <= MOST_TOO_FAST * len(log):
        return
    said = (
        f"vx, vy, wz: {in_per_cent(many / len(log))} of the rows turn a wheel faster than the "
        f"motors of {vehicle.name} can ({fastest:.3g} m/s at its rim, with a full battery): "
        "another unit, or another robot"
    )
    yield Finding(TOO_FAST, "vx", many, said)


def _runs(log: Telemetry, residual: Array, model: PowerModel) -> Iterator[str]:
    """Whole runs that differ, by so many watts or as another load would make them.

    A load draws nothing at rest, and gives power back downhill: its mean over a run says little.
    """
    far = FAR * max(deviation(residual), 1e-300)
    kept = np.clip(residual, -far, far)
    heavier = log.rows.copy()
    heavier[:, INDEX["payload"]] += LOAD * model.vehicle.mass
    load = predict(model, replace(log, rows=heavier)) - predict(model, log)
    common_w = max(_common(log, kept, column) for column in (np.ones(len(log)), load))
    share = min(common_w**2 / max(float(np.mean(kept**2)), 1e-300), 1.0)
    much = common_w >= LEAST_OF_POWER * abs(float(log.power.mean()))
    if share >= LEAST_SHARE_APART and much:
        cause = "" if "payload" in log.present else " (a payload?)"
        yield (
            f"whole runs differ by {watts(common_w)}, {in_per_cent(share)} of the squared error, "
            f"and no column tells what changes from run to run{cause}"
        )


def _common(log: Telemetry, residual: Array, column: Array) -> float:
    """W rms, by how much of a column (n,) runs differ; 0 where their halves do not agree.

    The halves of a run have in common what noise within it has not.
    """
    shares, weights = [], []
    for start, stop in log.run_pieces():
        if stop - start < LEAST_RUN_ROWS:
            continue
        middle = (start + stop) // 2
        halves = slice(start, middle), slice(middle, stop)
        one, other = (float(column[half] @ column[half]) for half in halves)
        if one > 0.0 < other:
            first, second = (column[half] @ residual[half] for half in halves)
            shares.append((first / one, second / other))
            weights.append(one * other / (one + other))
    if len(shares) < LEAST_RUNS_APART:
        return 0.0
    (first, common), (_, second) = np.cov(np.array(shares).T, aweights=np.array(weights))
    correlation = common / max(math.sqrt(first * second), 1e-300)
    z = math.atanh(min(max(correlation, 0.0), 0.999999)) * math.sqrt(len(shares) - 3)
    agree = z >= LEAST_HALVES_Z
    return math.sqrt(common) * float(np.sqrt(np.mean(column**2))) if agree else 0.0


def _power(log: Telemetry, residual: Array) -> Iterator[str]:
    """A power that varies, and not with the motion, or one that does not vary as it must."""
    variation, expected = float(log.power.std()), float((log.power - residual).std())
    varies = variation >= VARYING * abs(float(log.power.mean())) and variation > 0.0
    if len(log) < LEAST_ROWS:
        return
    if not varies and variation < VARYING * expected:
        yield (
            f"the power varies by {watts(variation)}, though this motion needs one that varies by "
            f"about {watts(expected)}: a set-point, a reading that is held, or another quantity"
        )
        return
    if not varies:
        return
    explained = max(0.0, 1.0 - float(np.mean(residual**2)) / variation**2)
    if explained < LEAST_EXPLAINED_POWER:
        absent = [name for name in ("roll", "pitch", "payload") if name not in log.present]
        logged = f" (it has no {' and no '.join(absent)})" if absent else ""
        yield (
            f"the model explains {in_per_cent(explained)} of how the power varies: columns that "
            f"the log needs are missing{logged}, or its times and units do not belong together"
        )
