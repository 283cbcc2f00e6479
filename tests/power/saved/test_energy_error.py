"""What a fit leaves open about energies: covariance by name, noise of a measured drive."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from planner.power.saved.energy_error import Covered, EnergyError, ParameterCovariance

POWER, RESISTANCE = ("electronics", "power", 0), ("copper_loss", "resistance", 0)
ERROR = EnergyError(
    powers_w=(1.0, 20.0),
    spreads_w=(0.1, 0.4),
    correlation_time_s=0.7,
    run_offset_w=0.02,
    run_gain=0.003,
    scale=1.2,
    degrees_of_freedom=12.0,
    runs=16,
)


def test_a_covariance_goes_by_name() -> None:
    """In whatever order a model has its parameters; zero for those that it does not name."""
    covariance = ParameterCovariance((POWER, RESISTANCE), np.array([[0.04, 0.1], [0.1, 1.0]]))
    other = ("inertia", "yaw_inertia", 0)
    assert np.array_equal(
        covariance.matrix([RESISTANCE, other, POWER]),
        [[1.0, 0.0, 0.1], [0.0, 0.0, 0.0], [0.1, 0.0, 0.04]],
    )


def test_noise_of_a_drive_by_hand() -> None:
    # At 10.5 W the spread lies halfway, at 0.25 W; braking at -10.5 W is as noisy. E = 21 J.
    watts, seconds = np.array([10.5, 10.5, -10.5]), np.array([2.0, 1.0, 1.0])
    rows = 0.7 * 0.25**2 * 4.0
    assert ERROR.noise_variance(watts, seconds) == pytest.approx(
        rows + (0.02 * 4.0) ** 2 + (0.003 * 21.0) ** 2, rel=1e-12
    )


def test_offset_and_gain_do_not_average_out() -> None:
    def relative(seconds: float) -> float:
        variance = ERROR.noise_variance(np.array([10.0]), np.array([seconds]))
        return math.sqrt(variance) / (10.0 * seconds)

    assert relative(100.0) < relative(1.0)
    assert relative(1e9) == pytest.approx(math.hypot(0.02 / 10.0, 0.003), rel=1e-3)


def test_documents_give_back_the_same_numbers() -> None:
    covariance = ParameterCovariance((POWER, RESISTANCE), np.array([[0.04, 0.1], [0.1, 1 / 3]]))
    written = json.loads(json.dumps([covariance.document(), ERROR.document()]))
    back = ParameterCovariance.from_document(written[0])
    assert back.names == covariance.names
    assert np.array_equal(back.values, covariance.values)
    assert EnergyError.from_document(written[1]) == ERROR
    seen = replace(ERROR, covered=Covered(1.1, 1 / 3, 0.0))
    assert EnergyError.from_document(json.loads(json.dumps(seen.document()))) == seen
