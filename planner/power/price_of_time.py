"""A price of time: watts on top of a model's own, so that what costs least energy is also quick.

    priced = with_price_of_time(model, 50.0)            # W, that is J for every second

    ∫ (P + λ) dt = E + λ·T

What is minimised with such a model is the energy E plus λ times the duration T: steady costs, yaw
and speed programmes, ramps and stops all know the price without being told. With λ = 0 that is the
energy alone, with λ → ∞ the time alone. What a motion found so really draws is for the model
without the price to say.

The price acts behind everything else, at the source, so that no loss or limit of the supply changes
it. It is no effect of the catalogue: no robot has it and no log can show it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.power.effect import Effect, Parameter
from planner.power.model import PowerModel


class PriceOfTime(Effect):
    """Constant watts that stand for what a second is worth."""

    # A name that no effect of a user's can have.
    slug = "_price_of_time"
    title = "price of time"
    loss = True

    price = Parameter(
        unit="W", default=0.0, null=0.0, bounds=(0.0, 1e12), fitted=False, doc="J for a second."
    )

    @staticmethod
    def supply(price):  # type: ignore[no-untyped-def]  # takes real and complex numbers
        """W beside what the source gives."""
        return price


def with_price_of_time(model: PowerModel, price: float) -> PowerModel:
    """The model with every second priced.

    Args:
        model: without a price.
        price: W (J for a second), ≥ 0.
    """
    return replace(
        model,
        effects=(*model.effects, PriceOfTime),
        parameters=np.append(model.parameters, price),
        # Nothing of this was fitted.
        stderr=None,
        covariance=None,
        energy_error=None,
    )
