"""What a fit leaves open about the energy of a drive: its parameters, and the noise of one drive.

    covariance = ParameterCovariance((("wheel_rolling", "rolling", 0),), values)
    covariance.matrix(names)                         # (P, P), in the order of a model's parameters
    error.noise_variance(watts, seconds)             # J² of one measured drive
    error.scale, error.degrees_of_freedom            # what held-out runs said about both

Made by planner.telemetry.estimation from the log that a model was fitted to, kept with
the model, and read where the energy of a route is reported
(planner.search.results.energy_interval). The noise of a drive's measured energy is

    Var = correlation_time · Σ σ(|P|)²·dt  +  (run_offset·T)²  +  (run_gain·E)²

with σ the standard deviation of single rows, T the duration and E the energy. The first term is a
sum over many rows; ``correlation_time`` is the rows' interval where they are independent of each
other, and longer where they are not. The other two do not average out along a drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from planner.arrays import Array

Name = tuple[str, str, int]
"""Effect's slug, name of the parameter, element."""


@dataclass(frozen=True, eq=False)
class ParameterCovariance:
    """Covariance of parameters, by name: it survives when effects are added or left out.

    Attributes:
        names: (k,) of the parameters.
        values: (k, k), in the parameters' SI units.
    """

    names: tuple[Name, ...]
    values: Array

    def matrix(self, names: Sequence[Name]) -> Array:
        """(P, P) for parameters in this order; zero for one that has no entry."""
        place = {name: number for number, name in enumerate(self.names)}
        known = [k for k, name in enumerate(names) if name in place]
        mine = [place[names[k]] for k in known]
        whole = np.zeros((len(names), len(names)))
        whole[np.ix_(known, known)] = self.values[np.ix_(mine, mine)]
        return whole

    def document(self) -> dict[str, Any]:
        """Ready for strict JSON; ``from_document`` reads it back bit by bit."""
        return {
            "parameters": [
                {"effect": effect, "name": name, "element": element}
                for effect, name, element in self.names
            ],
            "values": self.values.tolist(),
        }

    @classmethod
    def from_document(cls, document: Any) -> ParameterCovariance:
        """What ``document`` wrote, checked by saved_model."""
        names = tuple((p["effect"], p["name"], p["element"]) for p in document["parameters"])
        values = np.array(document["values"], float).reshape(len(names), len(names))
        return cls(names, values)


@dataclass(frozen=True)
class Covered:
    """The largest speed along the ground, slope along the travel and payload of a log's drives."""

    speed_mps: float
    slope_rad: float
    payload_kg: float


@dataclass(frozen=True)
class EnergyError:
    """Noise of one drive's measured energy, and how well intervals held on runs left out.

    Attributes:
        powers_w, spreads_w: |P| in W, ascending, and the standard deviation of a row there, linear
            in between.
        correlation_time_s: s, see above.
        run_offset_w: W, standard deviation of what is constant in a run.
        run_gain: the same as a share of the energy.
        scale: by which a predicted standard deviation is to be multiplied.
        degrees_of_freedom: of Student's t; small where few runs spoke.
        runs: number of held-out energies that ``scale`` comes from.
        covered: what the log holds; a fit has learnt nothing beyond. None in older files.
    """

    powers_w: tuple[float, ...]
    spreads_w: tuple[float, ...]
    correlation_time_s: float
    run_offset_w: float
    run_gain: float
    scale: float
    degrees_of_freedom: float
    runs: int
    covered: Covered | None = None

    def noise_variance(self, watts: Array, seconds: Array) -> float:
        """J², of the measured energy of one drive, before ``scale``.

        Args:
            watts: (n,) W of the model.
            seconds: (n,) s that each stands for.
        """
        spread = np.interp(np.abs(watts), self.powers_w, self.spreads_w)
        rows = self.correlation_time_s * float(spread**2 @ seconds)
        duration, energy = float(seconds.sum()), float(watts @ seconds)
        return rows + (self.run_offset_w * duration) ** 2 + (self.run_gain * energy) ** 2

    def document(self) -> dict[str, Any]:
        """Ready for strict JSON."""
        noise = asdict(self)
        held_out = {name: noise.pop(name) for name in ("runs", "scale", "degrees_of_freedom")}
        lists = {name: list(noise[name]) for name in ("powers_w", "spreads_w")}
        covered = noise.pop("covered")
        document = {"noise": noise | lists, "held_out": held_out}
        return document | ({"covered": covered} if covered else {})

    @classmethod
    def from_document(cls, document: Any) -> EnergyError:
        """What ``document`` wrote, checked by saved_model."""
        both = {**document["noise"], **document["held_out"]}
        names = [field.name for field in fields(cls) if field.name != "covered"]
        values: dict[str, Any] = {name: both[name] for name in names}
        if (covered := document.get("covered")) is not None:
            values["covered"] = Covered(**covered)
        tuples = {name: tuple(values[name]) for name in ("powers_w", "spreads_w")}
        return cls(**values | tuples)
