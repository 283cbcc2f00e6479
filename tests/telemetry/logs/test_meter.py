"""A meter in words and numbers, and when two estimates are the same."""

from __future__ import annotations

from dataclasses import replace

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
