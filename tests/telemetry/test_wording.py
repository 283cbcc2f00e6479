"""Figures of the workbench as people read them: no rounding noise, zero without a minus."""

from __future__ import annotations

import pytest

from planner.telemetry.wording import estimate, number, share, signed, watts


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (watts(-1.4e-14), "0.000 W"),
        (watts(-0.041), "-0.041 W"),
        (signed(-1.4e-14), "+0.000 W"),
        (signed(-0.041), "−0.041 W"),
        (share(-1e-17), "0.0 %"),
        (share(-0.02), "-2.0 %"),
        (estimate(-1.4e-14, 0.01, "m²"), "0 ± 0.01 m²"),
        (estimate(0.2213, 0.0041, "m²"), "0.2213 ± 0.0041 m²"),
        (estimate(0.0123, 0.5, "1"), "0.0123 ± 0.5"),
        # Without an error there is nothing to measure it by.
        (number(1.4e-14), "1.4e-14"),
        (number(1.4e-14, float("nan")), "1.4e-14"),
    ],
)
def test_what_the_digits_do_not_show_is_zero(said: str, expected: str) -> None:
    assert said == expected
