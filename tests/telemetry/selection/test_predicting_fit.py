"""Fits with effects added: what lasts for a few runs is no noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.quantities import INDEX
from planner.telemetry.estimation import fit
from planner.telemetry.holdout import heldout_residual, rms
from planner.telemetry.selection.predicting_fit import predicting_fit
from planner.telemetry.terms import Addition, fit_with
from tests.telemetry.rows import measured

CARPET = Addition("surface_rolling", {("excess", 1): 0.2})


@pytest.mark.parametrize("pull", [6.0, 20.0])
def test_a_carpet_in_three_runs_is_not_taken_for_noise_of_runs(motion, base, pull):
    """Its drag is not quite the catalogue's, so that the misfit scatters as noise of runs does."""
    carpet = np.isin(motion.run, [3, 8, 12])
    rows = motion.rows.copy()
    rows[:, INDEX["surface"]] = carpet
    log = replace(motion, rows=rows, surfaces=("floor", "carpet"))
    vx, vy = (np.abs(rows[:, INDEX[name]]) for name in ("vx", "vy"))
    log = measured(log, base, 0.02, seed=5, extra=np.where(carpet, pull * (vx + 0.5 * vy), 0.0))
    without = fit(log, base)
    given = without.model, log, [CARPET]
    whitened = fit_with(*given, noise=without.noise)
    found = predicting_fit(*given, noise=without.noise)
    bias, left, least = (float(one.residual[carpet].mean()) for one in (without, whitened, found))
    assert left > 0.1 * bias  # the noise that was estimated without the carpet holds it back
    assert abs(least) < 0.06 * bias
    assert rms(heldout_residual(log, found)) < 0.85 * rms(heldout_residual(log, whitened))


def test_where_the_model_is_right_the_noise_weights_the_rows(motion, base):
    """With noise that follows the power, quiet rows tell most."""
    log = measured(motion, base, 0.0, seed=1)
    spread = 0.1 * np.abs(log.power)
    noise = spread * np.random.default_rng(2).standard_normal(len(log))
    log = replace(log, power=log.power + noise)
    without = fit(log, base)
    air = Addition("air_drag", {("drag_area", 0): 0.05})
    found = predicting_fit(without.model, log, [air], noise=without.noise)
    assert found.noise.even_w == 0.0
    assert found.model.parameters == pytest.approx(
        fit_with(without.model, log, [air], noise=without.noise).model.parameters, rel=1e-12
    )
