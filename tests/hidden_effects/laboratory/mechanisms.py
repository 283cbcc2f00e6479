"""Mechanisms that the catalogue does not have, each with the quantity that tells it.

    for name, mechanism in MECHANISMS.items():
        watts = mechanism.watts(rng, state)      # (bins,) W of any size

They load the bus. None of them stands in the catalogue or in the virtual robot under another name.
``state`` are the columns of virtual.dynamics by name, with speed, heading, slopes and time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.arrays import Array

State = dict[str, Array]


@dataclass(frozen=True)
class Mechanism:
    """One of them.

    Attributes:
        quantities: what it depends on, any of which tells it; names of
            ``outside_catalogue.quantities``.
        beside: names that may stand beside those.
        needs: of the drive, see drives.Conditions.
        columns: that the log must have.
        watts: of random numbers and a state, W up to a factor.
    """

    quantities: tuple[str, ...]
    beside: tuple[str, ...]
    needs: frozenset[str]
    columns: tuple[str, ...]
    watts: Callable[[dict[str, float], State], Array]


def drawn_numbers(rng: np.random.Generator) -> dict[str, float]:
    """Shares and signs that place thresholds, the same for all runs of a log."""
    return {
        "low": rng.uniform(0.2, 0.4),
        "middle": rng.uniform(0.4, 0.6),
        "sign": float(rng.choice([-1.0, 1.0])),
        "turn": rng.uniform(-math.pi, math.pi),
        "slow": rng.uniform(15.0, 60.0),
        "degrees": rng.uniform(6.0, 14.0),
    }


def _thermostatic_fan(own: dict[str, float], s: State) -> Array:
    """On above a temperature, off again some degrees below it."""
    low, high = s["temperature range"]
    on = low + own["middle"] * (high - low)
    off = on - 0.08 * (high - low)
    running = np.full(len(s["motor_temp"]), np.nan)
    running[s["motor_temp"] > on] = 1.0
    running[s["motor_temp"] < off] = 0.0
    if np.isnan(running[0]):
        running[0] = 0.0
    last = np.maximum.accumulate(np.where(np.isnan(running), 0, np.arange(len(running))))
    return np.asarray(running[last])


def _battery_heater(own: dict[str, float], s: State) -> Array:
    """Heats the battery in proportion to the cold."""
    low, high = s["ambient range"]
    return np.maximum(low + 0.7 * (high - low) - s["ambient"], 0.0)


def _holding_brake(own: dict[str, float], s: State) -> Array:
    """A coil that holds the brakes open while the robot is faster than a threshold."""
    return np.asarray(0.5 + 0.5 * np.tanh((s["speed"] - own["middle"] * s["top"]) / 0.02))


def _idling_bridge(own: dict[str, float], s: State) -> Array:
    """Switching losses of a modulation that gives up at speed."""
    return np.asarray(
        np.tanh(s["speed"] / 0.02) / (1.0 + (s["speed"] / (0.3 * own["middle"] * s["top"])) ** 2)
    )


def _tether(own: dict[str, float], s: State) -> Array:
    """A cable that drags on one side only."""
    return np.asarray(np.maximum(np.cos(s["heading"] - own["turn"]), 0.0) * s["speed"])


def _pawl(own: dict[str, float], s: State) -> Array:
    """A pawl that rattles while the robot backs up."""
    return np.asarray(s["speed"] * (np.cos(s["heading"]) < -0.1))


def _steering_hunt(own: dict[str, float], s: State) -> Array:
    """A servo that hunts in slow turns and is quiet in fast ones and in none."""
    rate = np.abs(s["wz"]) / (own["low"] * s["turning"])
    return np.asarray(rate * np.exp(1.0 - rate))


def _cable_reel(own: dict[str, float], s: State) -> Array:
    """A reel that resists turning to one side."""
    return np.maximum(own["sign"] * s["wz"], 0.0)


def _parking_pump(own: dict[str, float], s: State) -> Array:
    """A pump that works downhill, more the steeper."""
    return np.maximum(-s["slope_along"] - 0.01, 0.0) ** 2


def _skirt(own: dict[str, float], s: State) -> Array:
    """A skirt that touches the ground on side slopes."""
    return np.asarray(np.abs(s["slope_across"]) * s["speed"])


def _power_stage(own: dict[str, float], s: State) -> Array:
    """Saturation of an amplifier while the robot gains speed."""
    return np.maximum(s["acceleration"], 0.0) ** 2


def _brake_resistor(own: dict[str, float], s: State) -> Array:
    """A resistor in the bus that is switched in by braking."""
    return np.maximum(-s["acceleration"] - 0.05, 0.0) * s["speed"]


def _fender(own: dict[str, float], s: State) -> Array:
    """A fender that touches the wheels above some load."""
    return np.maximum(s["payload"] - own["low"] * s["heaviest"], 0.0) * s["speed"]


def _creeping_bearing(own: dict[str, float], s: State) -> Array:
    """A bearing that tightens from the start of a run."""
    return np.asarray((1.0 - np.exp(-s["time"] / own["slow"])) * s["speed"])


def _late_radio(own: dict[str, float], s: State) -> Array:
    """A transmitter that starts some time into every run."""
    return np.asarray(1.0 * (s["time"] > own["low"] * s["longest"]))


_SLOPES = frozenset({"slopes"})
_ANGLES = ("roll", "pitch")
MECHANISMS: dict[str, Mechanism] = {
    name: Mechanism(quantities, beside, frozenset(needs), columns, watts)
    for name, quantities, beside, needs, columns, watts in (
        ("thermostatic_fan", ("temperature",), ("time_since_start",), ("temperature",),
         ("motor_temp",), _thermostatic_fan),
        ("battery_heater", ("temperature",), (), ("temperature",), ("ambient_temp",),
         _battery_heater),
        ("holding_brake", ("speed",), (), (), (), _holding_brake),
        ("idling_bridge", ("speed",), (), (), (), _idling_bridge),
        ("tether", ("heading",), ("speed",), (), (), _tether),
        ("pawl", ("heading",), ("speed",), (), (), _pawl),
        ("steering_hunt", ("yaw_rate",), (), (), (), _steering_hunt),
        ("cable_reel", ("yaw_rate",), (), (), (), _cable_reel),
        ("parking_pump", ("slope_along",), (), _SLOPES, _ANGLES, _parking_pump),
        ("skirt", ("slope_across",), ("speed",), _SLOPES, _ANGLES, _skirt),
        ("power_stage", ("acceleration",), ("speed",), (), (), _power_stage),
        ("brake_resistor", ("acceleration",), ("speed",), (), (), _brake_resistor),
        ("fender", ("load",), ("speed",), ("payload",), ("payload",), _fender),
        ("creeping_bearing", ("time_since_start",), ("speed",), (), (), _creeping_bearing),
        ("late_radio", ("time_since_start",), (), (), (), _late_radio),
    )
}  # fmt: skip
