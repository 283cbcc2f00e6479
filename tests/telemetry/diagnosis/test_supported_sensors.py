"""When the error of a sensor is believed, and what follows when it is not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from planner.telemetry.diagnosis import supported_sensors


@pytest.mark.parametrize(
    ("before", "after", "searches"),
    [
        (3.0, 1.0, 1),  # it explains all that lies above the noise
        (3.0, 2.95, 2),  # it explains next to nothing
        (3.0, 1.5, 2),  # it explains most, and leaves half as much again as the noise
    ],
)
def test_a_refused_sensor_leads_to_a_search_without_sensors(
    motion, monkeypatch, before, after, searches
):
    """Errors of the log before and after its correction, in units of the noise."""
    noise = np.clip(np.random.default_rng(8).standard_normal(len(motion)), -3.0, 3.0)
    monkeypatch.setattr(
        supported_sensors, "without_and_with_sensors", lambda *_: (before * noise, after * noise)
    )
    monkeypatch.setattr(supported_sensors, "floor_behind", lambda _: np.ones(len(motion)))
    asked = []

    def search(**how):
        asked.append(how)
        blamed = {} if "sensors" in how else {"slope_offset": (0.03, 0.002)}
        nothing = SimpleNamespace(members=())
        return SimpleNamespace(log=motion, corrections=blamed, selection=nothing)

    found = supported_sensors.with_supported_sensors(None, None, search)
    assert asked == [{}, {"sensors": frozenset()}][:searches]
    assert bool(found.corrections) == (searches == 1)
