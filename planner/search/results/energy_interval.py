"""How well a route's energy is known: interval, chance of the battery, what it hangs on.

    known = energy_distribution(model, rows, seconds, energy)
    known.interval_j                      # 95 %, J
    known.chance(available_j)             # that the energy is at most this
    for part in known.sensitivity: print(part.effect, part.parameter, part.share_of_variance)

Reported is the energy that would be measured on one drive along the planned motion:

    Var(E) = g'·C·g + noise of one drive                 g = ∂E/∂parameters

C is the covariance that adoption found (planner.telemetry.estimation), with
correlations; for a model that was never adopted, the declared spread of every parameter, taken as
independent, and nothing is known of the noise. What held-out runs said of such predictions widens
or narrows the result, and Student's t allows for how few they were.

Shares of the variance are those of R. M. Johnson, A heuristic method for estimating the relative
weight of predictor variables (2000): every parameter is split up into uncorrelated ones nearest to
it. They are never negative and add up to 1 with that of the noise.

Left out
    a robot that leaves the planned motion; conditions other than those of the request; what an
    effect outside the model would add.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from planner.arrays import Array
from planner.compiled_code import njit
from planner.power.account import ACCOUNT_LENGTH, PER_WHEEL
from planner.power.kernels import KERNEL
from planner.power.model import PowerModel
from planner.search.kernel_arguments import EAGER, F1, F2

NOISE = "noise"
"""Stands beside the effects for what one measured drive scatters by, whatever the parameters."""

MOST_ROUTE_ROWS = 600
"""Rows that stand for a route: what is uncertain needs no more digits than they give."""
DERIVATIVE_STEP = 1e-6
"""Step of a derivative relative to the parameter, or to its standard deviation if that is more."""
LEAST_SHARE = 1e-3
"""Share of the variance below which a parameter is not reported."""
_COVERED = 0.975  # two-sided 95 %
_WIDTHS = (ACCOUNT_LENGTH, len(PER_WHEEL))


@dataclass(frozen=True)
class Contribution:
    """What one parameter adds to the uncertainty of an energy.

    Attributes:
        effect: slug; "noise" for the scatter of one measured drive.
        parameter: name, with the wheel or ground where it has several.
        joules_per_sd: J that the energy is expected to differ by when the parameter is one standard
            deviation higher, others following as far as they are correlated with it.
        share_of_variance: of the whole, 0 to 1; all add up to 1.
        elasticity: relative change of the energy over that of this parameter alone; None for noise
            and for a route that needs no energy.
    """

    effect: str
    parameter: str
    joules_per_sd: float
    share_of_variance: float
    elasticity: float | None

    def to_json(self) -> dict[str, Any]:
        """One entry of ``sensitivity``."""
        return dict(vars(self))


@dataclass(frozen=True)
class EnergyDistribution:
    """Student's t about the planned energy.

    Attributes:
        energy_j: J, its middle.
        deviation_j: J, its scale; the standard deviation where the degrees of freedom are infinite.
        degrees_of_freedom: infinite where no held-out run was asked.
        sensitivity: the largest share of the variance first; parts below LEAST_SHARE are left out.
    """

    energy_j: float
    deviation_j: float
    degrees_of_freedom: float = math.inf
    sensitivity: tuple[Contribution, ...] = ()

    @property
    def interval_j(self) -> tuple[float, float]:
        """J, 95 %."""
        half = float(stdtrit(self.degrees_of_freedom, _COVERED)) * self.deviation_j
        return self.energy_j - half, self.energy_j + half

    def chance(self, available_j: float) -> float:
        """Probability that the energy is at most ``available_j``."""
        if self.deviation_j <= 0.0:
            return float(self.energy_j <= available_j)
        above = (available_j - self.energy_j) / self.deviation_j
        return float(stdtr(self.degrees_of_freedom, above))


def thinned(rows: Array, seconds: Array) -> tuple[Array, Array]:
    """About MOST_ROUTE_ROWS at most of a route's rows (n, ROW_LENGTH), and their seconds (n,)."""
    stride = max(1, len(rows) // MOST_ROUTE_ROWS)
    # Samples come in threes along a step: every third one would always have the same place in it.
    stride += stride % 3 == 0
    kept = seconds[::stride].copy()
    return rows[::stride].copy(), kept * (seconds.sum() / kept.sum()) if len(kept) else kept


def energy_distribution(
    model: PowerModel, rows: Array, seconds: Array, energy: float
) -> EnergyDistribution:
    """What is known of the energy of a motion.

    Args:
        model: the power model, with its covariance where it has one.
        rows: (n, ROW_LENGTH) along the motion.
        seconds: (n,) s that each stands for.
        energy: J of the whole motion.
    """
    if not len(rows):
        return EnergyDistribution(energy, 0.0)
    names = model.parameter_names
    if model.covariance is None:
        covariance = np.diag(model.uncertainty**2)
    else:
        covariance = model.covariance.matrix(names)
    deviations = np.sqrt(np.diag(covariance))
    places = np.flatnonzero(deviations > 0.0)
    deviations, covariance = deviations[places], covariance[np.ix_(places, places)]
    slopes, watts = _slopes(model, rows, seconds, places, deviations)
    unit = covariance / np.outer(deviations, deviations)
    size = slopes * deviations
    error = model.energy_error
    noise = 0.0 if error is None else error.noise_variance(watts, seconds)
    variance = max(float(size @ unit @ size), 0.0) + noise
    scale = 1.0 if error is None else error.scale
    parts = [
        Contribution(
            model.slots[place][0].slug,
            _called(model, int(place)),
            scale * float(along),
            float(weight) / variance if variance > 0.0 else 0.0,
            float(slope * model.parameters[place] / energy) if energy else None,
        )
        for place, along, weight, slope in zip(
            places, unit @ size, _weights(unit, size), slopes, strict=True
        )
    ]
    if noise > 0.0:
        one_drive = Contribution(
            NOISE, "one drive", scale * math.sqrt(noise), noise / variance, None
        )
        parts.append(one_drive)
    parts.sort(key=lambda part: -part.share_of_variance)
    return EnergyDistribution(
        energy,
        scale * math.sqrt(variance),
        math.inf if error is None else error.degrees_of_freedom,
        tuple(part for part in parts if part.share_of_variance >= LEAST_SHARE),
    )


def _weights(unit: Array, size: Array) -> Array:
    """(k,) J², parts of size'·unit·size, none below zero."""
    values, vectors = np.linalg.eigh(unit)
    root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    parts: Array = root**2 @ (root @ size) ** 2
    return parts


def _called(model: PowerModel, place: int) -> str:
    _, name, parameter, element = model.slots[place]
    if parameter.per == "surface" and model.surfaces:
        return f"{name} {model.surfaces[element]}"
    return f"{name} {element + 1}" if parameter.per == "wheel" else str(name)


def _slopes(
    model: PowerModel, rows: Array, seconds: Array, places: NDArray[np.int64], deviations: Array
) -> tuple[Array, Array]:
    """∂E/∂parameter, J per unit, at some places, and the power (n,) W.

    Differences of the real kernel, which is compiled already. The complex one would take ten
    seconds to compile for every new model, and agrees to 1e-5.
    """
    values = model.parameters
    high = np.array([model.slots[place][2].bounds[1] for place in places], float)
    steps = DERIVATIVE_STEP * np.maximum(np.abs(values[places]), deviations)
    # At a bound the step goes inwards: no formula is asked beyond its physical range.
    steps = np.where(values[places] + steps > high, -steps, steps)
    variants = np.tile(values, (len(places), 1))
    variants[np.arange(len(places)), places] += steps
    steps = variants[np.arange(len(places)), places] - values[places]
    changes, watts = np.zeros(len(places)), np.empty(len(rows))
    rows, seconds, values = (
        np.ascontiguousarray(part, dtype=float) for part in (rows, seconds, values)
    )
    _changes(
        model.kernel, rows, seconds, values, variants, model.body, model.wheels, watts, changes
    )
    return changes / steps, watts


@njit(types.void(KERNEL, F2, F1, F1, F2, F1, F2, F1, F1), **EAGER)
def _changes(
    kernel: Any,
    rows: Any,
    seconds: Any,
    parameters: Any,
    variants: Any,
    body: Any,
    wheels: Any,
    watts: Any,
    changes: Any,
) -> None:
    account = np.empty(_WIDTHS[0])
    per_wheel = np.empty((wheels.shape[0], _WIDTHS[1]))
    for k in range(rows.shape[0]):
        watts[k] = kernel(rows[k], parameters, body, wheels, account, per_wheel)
        for j in range(variants.shape[0]):
            moved = kernel(rows[k], variants[j], body, wheels, account, per_wheel)
            changes[j] += seconds[k] * (moved - watts[k])
