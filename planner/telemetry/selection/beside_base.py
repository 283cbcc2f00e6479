"""What an effect explains beside the base model, and not in the place of a part of it.

    left = left_beside_base(found, additions, fitted)

An effect that resembles a part of the base model may push that part out of its way. Sinkage then
takes the place of rolling resistance, or stiction that of gear friction. A robot has both, as its
data sheet says. Such an effect lowers the error by more than it can claim, as it explains the part
as well. So where a fit drives a base parameter to the end of its physical range, the parameter goes
back to its stated value, and the effect is judged by the held-out error that is left then.
"""

from __future__ import annotations

from collections.abc import Sequence

from planner.arrays import Array
from planner.telemetry.estimation import Fit
from planner.telemetry.selection.selection_loop import Found
from planner.telemetry.terms import Addition, Key

NEAR_BOUND = 1e-6
"""Share of a parameter's range within which it is at its end."""


def left_beside_base(found: Found, additions: Sequence[Addition], fitted: Fit) -> Array | None:
    """(n,) W, held-out residual of a claim while the base model keeps its stated parts.

    None where the fit keeps them anyway.

    Args:
        found: state of the search.
        additions: what is claimed.
        fitted: the model with that.
    """
    held = pushed_out(found, fitted)
    return found.heldout(found.refit(additions, held=held)) if held else None


def pushed_out(found: Found, fitted: Fit) -> dict[Key, float]:
    """Base parameters that a fit left at the end of their range → their stated values."""
    base = found.base
    stated = dict(zip(base.model.parameter_names, base.model.parameters.tolist(), strict=True))
    for place, value in zip(base.places, base.start.tolist(), strict=True):
        stated[base.model.parameter_names[place]] = value
    pushed = {}
    for place in fitted.places:
        key, (low, high) = fitted.model.parameter_names[place], fitted.model.slots[place][2].bounds
        value, near = float(fitted.model.parameters[place]), NEAR_BOUND * (high - low)
        at_end = value - low <= near or high - value <= near
        if key in stated and at_end and abs(stated[key] - value) > near:
            pushed[key] = stated[key]
    return pushed
