"""A meter in words and numbers, and when two estimates are the same."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.telemetry.logs import Meter, same_meter


def test_meters_are_the_same_within_their_errors():
    meter = Meter(0.5, 0.0, "mean", 0.02, 0.01)
    assert same_meter(None, None)
    assert not same_meter(meter, None)
    assert same_meter(meter, replace(meter, time_constant_s=0.51))
    assert not same_meter(meter, replace(meter, time_constant_s=0.6))
    assert not same_meter(meter, replace(meter, sampling="end"))


def test_sentence_and_document_say_the_same():
    meter = Meter(0.4, 0.0, "end", 0.02, 0.01)
    assert meter.sentence == (
        "Your meter averages over 0.400 ± 0.020 s and is read at the end of each row"
    )
    document = meter.to_json()
    assert document["time_constant_s"] == {"value": 0.4, "stderr": 0.02}
    assert document["sampling"] == "end"


def test_what_shifts_a_time_constant_is_in_its_error_and_not_in_the_search():
    meter = Meter(0.4, 0.0, "end", 0.03, 0.01, time_constant_shift_s=0.04)
    assert meter.to_json()["time_constant_s"]["stderr"] == pytest.approx(0.05)
    assert "0.400 ± 0.050 s" in meter.sentence
    assert not same_meter(meter, replace(meter, time_constant_s=0.45))


def test_a_mean_that_is_shorter_than_its_error_has_an_end_alone():
    meter = Meter(0.05, 0.0, "window", 4.0)
    assert meter.sentence == "Your meter averages evenly over less than 4 s"
    assert "over less than 0.044 s" in Meter(0.004, 0.1, "held", 0.04, 0.01).sentence
