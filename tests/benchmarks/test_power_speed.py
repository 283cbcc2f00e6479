"""The power model: a microsecond at most, much less in blocks; a known model starts at once."""

from __future__ import annotations

import pytest

from tests.benchmarks.power import measure


@pytest.mark.bench
def test_power_model_is_fast_enough() -> None:
    found = measure()
    assert found["power_ns"] <= 1000.0
    assert found["blocks_ns"] <= 0.6 * found["power_ns"]
    assert found["catalogue_blocks_ns"] <= 0.4 * found["catalogue_ns"]
    assert found["power_first_s"] <= 8.0
    assert found["power_again_s"] <= 1.0
    assert found["power_error"] <= 0.1
