"""How long a client that found the queue full is asked to wait."""

from __future__ import annotations

from service.jobs.pace import Pace


def test_what_is_there_is_worked_off_at_the_measured_pace() -> None:
    pace = Pace(2)
    for seconds in (2.0, 4.0):
        pace.add(seconds)
    assert pace.retry_after_s(6) == 9


def test_it_is_whole_seconds_and_never_none() -> None:
    pace = Pace(4)
    pace.add(0.001)
    assert pace.retry_after_s(3) == 1


def test_a_change_of_load_is_followed() -> None:
    pace = Pace(1)
    for seconds in [100.0] * 200 + [1.0] * 50:
        pace.add(seconds)
    assert pace.retry_after_s(1) == 1
