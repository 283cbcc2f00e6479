"""A time weight: constant watts on top of a model's own, so that cheap motions are also quick.

    priced = with_time_weight(model, 50.0)            # W, that is J for every second

    ∫ (P + λ) dt = E + λ·T

The minimum of such a model is that of the energy E plus λ times the duration T. Steady costs, yaw
profiles, speed profiles, ramps and stops all include it. λ = 0 gives the least energy, λ → ∞ the
least time. The model without the weight gives the power of the motion that was found.

The weight acts behind everything else, at the source: no loss or limit of the supply changes it. It
is not an effect of the catalogue, since no robot has it and no log shows it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.power.effect import Effect, Parameter
from planner.power.model import PowerModel


class TimeWeight(Effect):
    """Constant watts: the worth of a second."""

    # No custom effect can have this name.
    slug = "_time_weight"
    title = "time weight"
    loss = True

    price = Parameter(unit="W", default=0.0, null=0.0, bounds=(0.0, 1e12), fitted=False)
    """J for a second."""

    @staticmethod
    def supply(price):  # type: ignore[no-untyped-def]  # takes real and complex numbers
        """W in addition to what the source gives."""
        return price


def with_time_weight(model: PowerModel, price: float) -> PowerModel:
    """The model with a time weight.

    Args:
        model: without a time weight.
        price: W (J for a second), ≥ 0.
    """
    return replace(
        model,
        effects=(*model.effects, TimeWeight),
        parameters=np.append(model.parameters, price),
        # Nothing of this was fitted.
        stderr=None,
        covariance=None,
        energy_error=None,
    )
