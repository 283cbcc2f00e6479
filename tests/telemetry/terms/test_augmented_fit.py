"""An effect that is added is fitted with all that it has, and its errors say how sure that is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.power.model import PowerModel
from planner.telemetry.terms.augmented_fit import Addition, fit_with
from planner.telemetry.terms.candidate_terms import candidate_library
from tests.power.states import changed
from tests.telemetry.rows import measured


def robot_with(base, slug, **values):
    model = PowerModel.from_vehicle(base.vehicle, effects=(slug,))
    return changed(model, **{f"{slug}__{name}": value for name, value in values.items()})


def with_wheels(base, excess):
    model = PowerModel.from_vehicle(base.vehicle, effects=("wheel_imbalance",))
    values = model.parameters.copy()
    values[[k for k, s in enumerate(model.slots) if s[0].slug == "wheel_imbalance"]] = excess
    return replace(model, parameters=values)


def found(fitted, slug):
    """(name, element) → parameter."""
    return {(p.name, p.element): p for p in fitted.parameters if p.effect == slug}


@pytest.fixture(scope="module")
def library(motion, base):
    """Columns of the catalogue on the varied drive."""
    return candidate_library(base, motion)


# The third wheel drags a tenth of the mean; against the fourth alone that is beyond any bound.
UNEVEN = np.array([0.35, 0.15, -0.9, 0.4])


@pytest.mark.parametrize("common", [0.0, 0.7])
def test_wheels_differ_from_their_mean(motion, base, common):
    log = measured(motion, with_wheels(base, UNEVEN + common), 0.01, seed=3)
    some = Addition("wheel_imbalance", {("excess", 0): 0.1})
    excess = found(fit_with(base, log, [some]), "wheel_imbalance")
    assert len(excess) == 4
    assert sum(p.value for p in excess.values()) == pytest.approx(0.0, abs=1e-3)
    for wheel in range(4):
        parameter = excess["excess", wheel]
        assert abs(parameter.value - UNEVEN[wheel]) < 4.0 * parameter.stderr
        assert parameter.stderr < 0.1


def test_a_shape_need_not_stand_on_its_grid(motion, base, library):
    log = measured(motion, robot_with(base, "stiction", strength=1.5, stiction_speed=0.04), 0.01, 5)
    on_grid = Addition("stiction", {("strength", 0): 1.0}, {"stiction_speed": 0.02})
    alone = found(fit_with(base, log, [on_grid]), "stiction")
    freed = found(fit_with(base, log, [on_grid.completed(library)]), "stiction")
    assert set(alone) == {("strength", 0)}
    for name, value in (("strength", 1.5), ("stiction_speed", 0.04)):
        assert abs(freed[name, 0].value - value) < 4.0 * freed[name, 0].stderr
    # Beside a shape that is wrong a strength is surer than it is right.
    off = alone["strength", 0]
    assert abs(off.value - 1.5) > 4.0 * off.stderr


def test_an_effect_acts_with_all_its_parameters(motion, base, library):
    heating = {"copper_coefficient": 0.0039, "magnet_coefficient": -0.0016}
    log = measured(motion, robot_with(base, "motor_heating", **heating), 0.01, seed=7)
    part = Addition("motor_heating", {("magnet_coefficient", 0): -0.003})
    alone = found(fit_with(base, log, [part]), "motor_heating")["magnet_coefficient", 0]
    assert abs(alone.value + 0.0016) > 4.0 * alone.stderr
    full = found(fit_with(base, log, [part.completed(library)]), "motor_heating")
    for name, value in heating.items():
        assert abs(full[name, 0].value - value) < 3.0 * full[name, 0].stderr
