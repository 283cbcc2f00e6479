"""What a search for missing effects found: its fit, its examination, and held-out residuals.

    found.refit(additions)              # the model fitted with these additions
    found.heldout(fitted)               # (n,) W, beside usual errors of what is given
    found.at_bounds(model)              # whether the base fit ran into bounds

selection_loop makes it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.arrays import Array
from planner.power.model import PowerModel
from planner.telemetry.estimation import Fit, fit
from planner.telemetry.evidence import Examination
from planner.telemetry.holdout import heldout_residual, rms
from planner.telemetry.logs import Telemetry
from planner.telemetry.selection.off_catalogue import ShapeFound, overlooked_shape
from planner.telemetry.selection.predicting_fit import predicting_fit
from planner.telemetry.selection.select_effects import Selection
from planner.telemetry.selection.unsure_power import unsure_power
from planner.telemetry.terms import Addition

NEAR_BOUND = 1e-6
"""Share of a parameter's range within which it is at its end."""


@dataclass(frozen=True)
class Found:
    """State of the search around the last linearisation.

    ``origin`` is where every fit with something added starts. ``searched`` is the fit of the search
    once everything was set free; None before. ``beside`` is as left_beside_base gives it.
    """

    log: Telemetry
    base: Fit
    examination: Examination
    selection: Selection
    fitted: Fit
    additions: tuple[Addition, ...]
    corrections: dict[str, tuple[float, float]]
    origin: PowerModel
    searched: Fit | None = None
    beside: Array | None = None

    def refit(self, additions: Sequence[Addition], *, tried: bool = False) -> Fit:
        """The origin fitted with additions; intervals of these are ``tried`` out as in fit_with."""
        noise, library = self.examination.noise, self.examination.competitors.library.model
        known = {effect.slug for effect in library.effects}
        within = library if all(a.declaration.slug in known for a in additions) else None
        unsure = self.examination.given if tried else None
        return predicting_fit(
            self.origin, self.log, additions, noise=noise, within=within, unsure=unsure
        )

    def left_beside_base(self, fitted: Fit) -> Array | None:
        """(n,) W, held-out residual of a claim while the base model keeps its stated parts.

        An effect that resembles a part of the base model may push that part out of its way. Sinkage
        then takes the place of rolling resistance, or stiction that of gear friction. A robot has
        both, as its data sheet says. So where a fit drives a base parameter to the end of its
        physical range, the parameter goes back to its stated value. None where none is there.

        Args:
            fitted: the model with what is claimed.
        """
        held = self.pushed_out(fitted)
        if not held:
            return None
        values = fitted.model.parameters.copy()
        for place, value in held.items():
            values[place] = value
        # From where the claim has its parts already, or others may take their place on the way.
        kept = replace(fitted.model, parameters=values)
        free = [place for place in fitted.places if place not in held]
        return self.heldout(fit(self.log, kept, free=free, noise=self.examination.noise))

    def pushed_out(self, fitted: Fit) -> dict[int, float]:
        """Numbers of base parameters that a claim drives to the end of their range → stated values.

        One that stands there without the claim, too, is not driven by it: the log asks for it.
        """
        begun, alone = self.base.begun, self.base.model
        stated = dict(zip(begun.parameter_names, begun.parameters.tolist(), strict=True))
        before = dict(zip(alone.parameter_names, alone.parameters.tolist(), strict=True))
        pushed = {}
        for place in fitted.places:
            key = fitted.model.parameter_names[place]
            low, high = fitted.model.slots[place][2].bounds
            value, near = float(fitted.model.parameters[place]), NEAR_BOUND * (high - low)
            at_end = value - low <= near or high - value <= near
            driven = (
                key in stated and min(abs(each[key] - value) for each in (stated, before)) > near
            )
            if at_end and driven:
                pushed[place] = stated[key]
        return pushed

    def heldout(self, fitted: Fit, beside: Array | None = None) -> Array:
        """(n,) W, held-out residual of a fit.

        Usual errors of what is given explain what they can where that predicts better. Beside a
        model that lacks much they may take its place, and on held-out runs make good ones worse.

        Args:
            fitted: the fit to all rows.
            beside: (n, k) W per standard deviation, what may explain a part of the power as well.
        """
        each = (
            heldout_residual(self.log, fitted, _together(columns, beside))
            for columns in self._unsure
        )
        return min(each, key=rms)

    @cached_property
    def _unsure(self) -> tuple[Array | None, ...]:
        """Columns (n, k) W that may explain parts of a held-out residual; None is none of them."""
        known, usual = self.given, self.examination.given
        if known is None:
            return None, usual
        if np.array_equal(known[:, : usual.shape[1]], usual):
            return None, known
        # Beside a model that lacks much they may predict no better, and yet beside the claim.
        return None, known, usual

    @cached_property
    def given(self) -> Array | None:
        """(n, k) W, what no effect needs to explain; None where that predicts no better."""
        return unsure_power(self.log, self.base, self.examination.given)

    def overlooked_shape(self, floor: Array, most: float = math.inf) -> ShapeFound | None:
        """The shape that alone predicts held-out runs best, by ``floor`` (n,) W of single rows."""
        return overlooked_shape(self.log, self.examination, floor, most)

    def at_bounds(self, start: PowerModel) -> bool:
        """Whether the base fit ran into physical bounds: something strong is missing."""
        for place in self.base.places:
            low, high = start.slots[place][2].bounds
            before, value = start.parameters[place], self.base.model.parameters[place]
            near = NEAR_BOUND * (high - low)
            if before != value and (value - low <= near or high - value <= near):
                return True
        return False


def _together(*columns: Array | None) -> Array | None:
    """Columns side by side; None where there are none."""
    given = [each for each in columns if each is not None]
    return np.column_stack(given) if given else None
