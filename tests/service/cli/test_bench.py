"""Timing this machine can be stopped."""

from __future__ import annotations

import pytest

from planner.errors import Cancelled
from service.cli.bench import measure


def test_cancelling_ends_it_after_the_measurement_that_runs() -> None:
    asked: list[int] = []

    def cancelled() -> bool:
        asked.append(1)
        return True

    with pytest.raises(Cancelled):
        measure(1_000, cancelled=cancelled)
    assert len(asked) == 1
