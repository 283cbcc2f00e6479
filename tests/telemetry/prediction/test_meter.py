"""What a meter shows: against fine integration, and nothing where it does nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.telemetry.logs import Meter, Telemetry
from planner.telemetry.prediction import (
    Nodes,
    Readings,
    meter_columns,
    predict,
    tangent,
)
from planner.telemetry.prediction.held_readings import held_rows


def behind(log: Telemetry, **numbers) -> Telemetry:
    return replace(log, meter=Meter(**numbers))


def integrated(log: Telemetry, watts, tau: float, delay: float):
    """The filter's answer to a power linear between the middles of rows, by 400 steps a row."""
    result = np.empty(len(log))
    for start, stop in log.segments():
        middle = (log.time - 0.5 * log.interval)[start:stop]
        part = watts[start:stop]
        # Before the first row: that row's reading, one interval earlier.
        state = log.power[start]
        step = log.interval[start]
        state = part[0] + (state - part[0]) * np.exp(-step / tau)
        result[start] = state
        for k in range(1, stop - start):
            times = np.linspace(middle[k - 1], middle[k], 401)
            fine = times[1] - times[0]
            inside = np.interp(times - delay, middle, part)
            for here in 0.5 * (inside[1:] + inside[:-1]):
                state += (here - state) * -np.expm1(-fine / tau)
            result[start + k] = state
    return result


@pytest.mark.parametrize(("tau", "delay"), [(0.2, 0.0), (0.8, 0.1)])
def test_filter_is_that_of_fine_integration(motion, base, tau, delay):
    # A late power is linear between its own rows and not quite between those of the log.
    log = behind(motion.take(slice(0, 110)), time_constant_s=tau, delay_s=delay)
    watts = predict(base, replace(log, meter=None))
    shown = Readings.of(log).shown(watts)
    exact = integrated(log, watts, tau, delay)
    close = 1e-3 if delay == 0.0 else 0.05
    assert np.abs(shown - exact).max() < close * np.ptp(watts)


@pytest.mark.parametrize("rows", [0.6, 3.7])
def test_a_window_shows_the_mean_of_the_power_since_it_began(motion, base, rows):
    """Between the ends of rows the power is linear; before a run there is its first reading."""
    log = motion.take(slice(0, 220))
    seconds = rows * float(log.interval[0])
    log = behind(log, time_constant_s=seconds, sampling="window")
    watts = predict(base, replace(log, meter=None))
    shown, late = Readings.of(log).shown(watts), Readings.of(behind(log, sampling="end"))
    for start, stop in log.segments():
        time, ends = log.time[start:stop], late.shown(watts)[start:stop]
        for k in range(stop - start):
            fine = np.linspace(time[k] - seconds, time[k], 2001)
            inside = np.where(fine < time[0], log.power[start], np.interp(fine, time, ends))
            # Where a window begins, the power is taken as even between two rows.
            assert shown[start + k] == pytest.approx(inside.mean(), abs=0.15 * np.ptp(watts) / rows)


@pytest.mark.parametrize("sampling", ["mean", "held"])
def test_no_filter_and_no_delay_show_the_power_itself(motion, base, sampling):
    delay = 0.0 if sampling == "mean" else 0.5 * float(motion.interval[0])
    scatter = np.random.default_rng(2).standard_normal(len(motion))
    log = behind(replace(motion, power=scatter), sampling=sampling, delay_s=delay)
    assert np.array_equal(held_rows(log), np.arange(len(log)))
    assert predict(base, log) == pytest.approx(predict(base, motion), rel=1e-12)


def test_steady_power_is_shown_as_it_is_however_slow_the_meter(motion):
    log = behind(replace(motion, power=np.full(len(motion), 7.0)), time_constant_s=2.0)
    assert Readings.of(log).shown(log.power) == pytest.approx(log.power, rel=1e-12)


def test_columns_go_through_the_same_filter(motion, base):
    """Power is linear in a constant load: its column is what a watt more looks like."""
    log = behind(motion, time_constant_s=0.4, sampling="end")
    place = next(k for k, key in enumerate(base.parameter_names) if key[0] == "electronics")
    watts, columns = tangent(base, Nodes.of(log, base), [place])
    values = base.parameters.copy()
    values[place] += 1.0
    more = predict(replace(base, parameters=values), log)
    assert more - watts == pytest.approx(columns[:, 0], abs=1e-6)
    assert Readings.as_shown(log, np.ones((len(log), 1))) == pytest.approx(columns, abs=1e-6)


def test_readings_at_the_end_of_rows_lead_those_of_their_middle(motion):
    log = motion.take(slice(0, 110))
    watts = 10.0 + 0.3 * log.time
    end = Readings.of(behind(log, sampling="end")).shown(watts)
    inside = slice(1, -1)
    assert (end - watts)[inside] == pytest.approx(0.15 * log.interval[inside], rel=1e-9)


def test_held_rows_show_the_row_in_which_the_reading_was_new(motion):
    power = np.repeat(np.arange(22.0), 5)
    log = behind(replace(motion.take(slice(0, 110)), power=power), sampling="held")
    assert np.array_equal(held_rows(log), np.arange(110) // 5 * 5)
    shown = Readings.of(log).shown(np.arange(110.0) ** 2)
    assert np.array_equal(np.flatnonzero(np.diff(shown)) % 5, np.full(21, 4))


def test_derivatives_are_those_of_the_readings(motion, base):
    log = behind(motion, time_constant_s=0.5, delay_s=0.1)
    watts = predict(base, motion)
    step = 1e-4
    for number, name in enumerate(("time_constant_s", "delay_s")):
        meter = log.meter.with_number(name, getattr(log.meter, name) + step)
        more = Readings.of(replace(log, meter=meter)).shown(watts)
        slope = (more - Readings.of(log).shown(watts)) / step
        found = meter_columns(log, watts)[:, number]
        assert np.linalg.norm(found - slope) < 0.03 * np.linalg.norm(slope)
    assert meter_columns(motion, watts).shape == (len(motion), 0)
