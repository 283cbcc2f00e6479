"""PowerModel: rows, shares, derivatives, saving and loading, and compiled code on disk."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.power.rows import rows_from
from tests.power.states import column, model_with, random_columns


def test_one_row_at_a_time_or_all_at_once() -> None:
    model = model_with()
    rows = rows_from(**random_columns(20, seed=16))
    single = [model.watts(row[None])[0] for row in rows]
    assert np.array_equal(model.watts(rows), single)
    assert model.watts(rows[:0]).shape == (0,)


def test_jacobian_shape_and_a_derivative_by_hand() -> None:
    # dP/dP_0 is 1/η of the converter; dP/d(b) is Σω² plus the current it takes.
    model = model_with()
    rows = rows_from(vx=[0.3, 0.6])
    slopes = model.jacobian(rows)
    assert slopes.shape == (2, len(model.parameters))
    names = [(effect.slug, name) for effect, name, _, _ in model.slots]
    electronics = slopes[:, names.index(("electronics", "power"))]
    assert electronics == pytest.approx([1.0 / 0.88] * 2, rel=1e-12)
    viscous = slopes[:, names.index(("viscous_drag", "viscous_torque"))]
    assert np.all(viscous > 4.0 * (26.85 * np.array([0.3, 0.6]) / 0.076) ** 2)


def test_uncertainty_is_the_prior_spread_until_fitted() -> None:
    model = model_with()
    place = next(k for k, slot in enumerate(model.slots) if slot[1] == "rolling")
    assert model.uncertainty[place] == pytest.approx(0.25 * 0.035)
    stderr = np.full(len(model.parameters), math.nan)
    stderr[place] = 0.001
    assert replace(model, stderr=stderr).uncertainty[place] == 0.001


def test_a_stated_uncertainty_stands_for_the_prior_spread() -> None:
    model = model_with()
    provenance = replace(model.vehicle.provenance, uncertainties={"electronics.power": 0.01})
    sure = replace(model, vehicle=replace(model.vehicle, provenance=provenance))
    place = next(k for k, slot in enumerate(model.slots) if slot[0].slug == "electronics")
    assert sure.uncertainty[place] == pytest.approx(0.01 * model.parameters[place])
    others = np.arange(len(model.parameters)) != place
    assert np.array_equal(sure.uncertainty[others], model.uncertainty[others])


def test_default_surface_and_labels_beyond_the_model() -> None:
    model = model_with("surface_rolling", surface_rolling__excess=0.5)
    inside, none, beyond, unknown = model.watts(
        rows_from(vx=0.5, surface=[1.0, -1.0, 7.0, math.nan])
    )
    assert inside > none
    assert none == beyond == unknown


def test_payload_counts_in_mass_and_loads() -> None:
    model = model_with()
    rows = rows_from(vx=0.5, payload=[0.0, 6.0])
    account = model.account(rows)
    assert account["least_load"] == pytest.approx(np.array([12.0, 18.0]) * 9.80665 / 4.0)
    assert account["shaft"][1] / account["shaft"][0] == pytest.approx(1.5, rel=1e-9)
    assert column(rows, "payload")[1] == 6.0
