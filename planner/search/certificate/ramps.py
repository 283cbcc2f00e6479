"""Start and stop in the certified lower bound: prices of force that depend on the speed.

A robot that speeds up draws more than the price of steady driving, and one that brakes gets back
less; and while it is slow, its electronics draw power for little way. So near the start motion is
priced higher by δ(t) and near the goal lower, with t the share of full speed. The potential then
holds, beside what certified_bound says,

    ± place · fall(t),   fall(1) = 0,   -fall' = v²·t·(m·|δ| + m'·|δ'|) + v·κ

with + at the start, - at the goal, and ``place`` 0 but for some metres round it. At rest that is a
gain at both ends. It is paid for where, with the acceleration a at most,

    Q_t(μ + δ) + M·g·δ·(climb per second) - κ·a ≥ t·Q(μ)

for dual_power's least power at the speed t·v. ``ramp_for`` chooses δ and
κ by the prices and slopes at a place; any choice gives a bound, as ``ramp_cost`` tells what a metre
may cost in a triangle for all of it to be paid. docs/lower-bound.md has the inequalities.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from planner.arrays import Array
from planner.search.certificate.dual_power import rotor_share
from planner.search.certificate.price_table import (
    PriceTable,
    between,
    node_of,
    rotor_price,
    table_watts,
)

PARTS = (0.0, 0.04, 0.07, 0.11, 0.16, 0.23, 0.32, 0.42, 0.52, 0.62, 0.73, 0.84, 0.94)
"""Shares of full speed between which δ and κ are constant; in the first step, whose table is the
weakest, and above the last they are nothing."""
STEPS = np.arange(0.0, 1.21, 0.05)
"""|δ| that are tried."""
ROOMY = 0.4
"""Share of the least cost nearby that δ may take on the steepest slope there."""


class Ramp(NamedTuple):
    """What one end asks for, as the compiled loops read it.

    ``sign`` is 1 at the start and -1 at the goal; ``place`` (ny, nx) from 0 to 1; ``watts`` (parts,
    a, b, 2) the table at the speeds ``parts``; ``dearer`` and ``rotor`` (parts - 1,) are δ and that
    of the rotors; ``held`` (parts - 1,) W is κ·a; ``fall`` (parts,) J.
    """

    sign: float
    place: Array
    watts: Array
    parts: Array
    dearer: Array
    rotor: Array
    held: Array
    fall: Array


@dataclass(frozen=True)
class Nearby:
    """Prices at one end and the ground round it.

    Attributes:
        share, rotor, cross: prices along the travel, of the rotors and across.
        slope: along the travel, the least favourable one nearby.
        steep: the largest one in any direction.
        cheapest: J/m of the cheapest direction.
        change: W that falling prices may earn at full speed.
        load: least share of the weight.
    """

    share: float
    rotor: float
    cross: float
    slope: float
    steep: float
    cheapest: float
    change: float
    load: float


def no_ramp(shape: tuple[int, ...]) -> Ramp:
    """Prices do not depend on the speed anywhere on the nodes."""
    none = np.zeros(0)
    return Ramp(1.0, np.zeros(shape), np.zeros((0, 2, 2, 2)), none, none, none, none, none)


def ramp_for(
    t: PriceTable, watts: Array, acceleration: float, sign: float, place: Array, here: Nearby
) -> Ramp:
    """The prices by speed that gain most at one end.

    Args:
        t: the table at full speed.
        watts: (parts, a, b, 2) the same at PARTS of it.
        acceleration: m/s² at most.
        sign: 1 at the start, -1 at the goal.
        place: (ny, nx) of the nodes.
        here: prices and ground there.
    """
    parts, v = np.array(PARTS), t.speed
    deltas = sign * STEPS[t.weight * STEPS * here.steep <= ROOMY * here.cheapest]
    shares = here.share + deltas
    rotors = rotor_share(shares, t.efficiency)
    off = abs(float(rotors[0]) - here.rotor)
    rotors = rotors - rotors[0]
    load = (here.load - t.load) / t.load_step if t.load_step > 0.0 else 0.0
    steady = table_watts(t, here.share, here.cross, here.load)
    slack = np.empty((len(parts), len(deltas)))
    for n, part in enumerate(parts):
        slack[n] = [_slow_watts(t, watts[n], float(s), here.cross, load) for s in shares]
        slack[n] -= part * (steady + off * t.rotor_slack) + (part - part**3) * here.change
        slack[n] += t.weight * deltas * part * v * here.slope
    dearer, rotor, held = np.zeros((3, len(parts) - 1))
    fall = np.zeros(len(parts))
    for k in reversed(range(1, len(parts) - 1)):
        low, high = parts[k], parts[k + 1]
        left = np.minimum(slack[k], slack[k + 1])
        gain = gained(t, (low, high), sign * deltas, sign * rotors, left / acceleration)
        gain = np.where(left >= 0.0, gain, 0.0)
        best = int(gain.argmax())
        fall[k] = fall[k + 1] + gain[best]
        if gain[best] > 0.0:
            dearer[k], rotor[k], held[k] = deltas[best], rotors[best], left[best]
    fall[0] = fall[1]
    return Ramp(sign, place, watts, parts, dearer, rotor, held, fall)


def gained(
    t: PriceTable, parts: tuple[float, float], delta: Array, rotor: Array, kappa: Array
) -> Array:
    """J by which ``fall`` changes between two parts of full speed, for |δ|, |δ'| and κ, W for
    each m/s²."""
    low, high = parts
    motion = 0.5 * (high**2 - low**2) * t.speed**2 * (t.moving * delta + t.rotors * rotor)
    return motion + (high - low) * t.speed * kappa


@njit(cache=True, error_model="numpy")
def _slow_watts(t: Any, watts: Any, share: float, cross: float, load: float) -> float:
    """One of the slower tables, the load as a share of its two; nan beyond it."""
    i, a, j, b = node_of(t, share, cross)
    if i < 0:
        return np.nan
    value: float = between(watts, i, a, j, b, load)
    return value


@njit(cache=True, error_model="numpy")
def ramp_cost(
    t: Any,
    r: Any,
    place: float,
    onward: float,
    share: float,
    cross: float,
    rotor: float,
    low: float,
    high: float,
    stretch: float,
    change: float,
    steady: float,
    standing: float,
    least_rise: float,
    most_rise: float,
) -> float:
    """J that a horizontal metre may cost at most for the price by speed to be paid for.

    Args:
        t, r: PriceTable and Ramp.
        place: at the node.
        onward: change of it with a metre of travel, times the ramp's sign.
        share, cross, rotor: prices along and across the travel, and the rotors' along.
        low, high: loads.
        stretch: most of what a horizontal metre is along the ground.
        change: W at most that falling prices may earn at full speed; it goes with its third power.
        steady, standing: W at full speed and left at rest, at these prices.
        least_rise, most_rise: slope along the travel.
    """
    v = t.speed
    least = min(max((low - t.load) / t.load_step, 0.0), 1.0) if t.load_step > 0.0 else 0.0
    most = min(max((high - t.load) / t.load_step, 0.0), 1.0) if t.load_step > 0.0 else 0.0
    if t.heavier:
        most = least
    found = np.inf
    for k in range(r.parts.shape[0] - 1):
        if r.fall[k] == 0.0:
            break
        more = place * r.dearer[k]
        lift = t.weight * min(more * least_rise, more * most_rise)
        off = abs(rotor_price(share + more, t.efficiency) - rotor - place * r.rotor[k])
        # The third power lies below its chord.
        bend = 0.75 * r.parts[k + 1] * (r.parts[k + 1] - r.parts[k]) ** 2
        i, a, j, b = node_of(t, share + more, cross)
        if i < 0:
            return -np.inf
        j1, b1 = j, b
        if cross != 0.0:
            _, _, j1, b1 = node_of(t, share + more, cross / stretch)
        for end in (k, k + 1):
            part = r.parts[end]
            watts = between(r.watts[end], i, a, j, b, least)
            watts = min(watts, between(r.watts[end], i, a, j1, b1, least))
            if most != least:
                watts = min(watts, between(r.watts[end], i, a, j, b, most))
                watts = min(watts, between(r.watts[end], i, a, j1, b1, most))
            watts -= off * part * t.rotor_slack
            if more == 0.0:
                watts = max(watts, part * steady + (1.0 - part) * standing)
            watts -= change * (part - part**3 + bend) + place * r.held[k]
            if part == 0.0:
                if watts < 0.0:
                    return -np.inf
                continue
            metre = watts / (part * v) * (1.0 if watts >= 0.0 else stretch)
            metre += lift + onward * (r.fall[end] if onward > 0.0 else r.fall[k])
            found = min(found, metre)
    return found
