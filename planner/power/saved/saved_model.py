"""The frame of a saved model's file: names, numbers of versions, history.

    SavedModel.check(document, where)

PowerModel.from_document reads the rest: effects, parameters and the vehicle.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from planner.errors import ModelError
from planner.validation import first_complaint

ACCEPTED = "a file that joulepath adopt wrote"


class _Errors(BaseModel):
    rmse_w: float | None = Field(default=None, allow_inf_nan=False)
    heldout_rmse_w: float | None = Field(default=None, allow_inf_nan=False)


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True)


class _Parameter(_Strict):
    effect: str = Field(min_length=1, max_length=255)
    name: str = Field(min_length=1, max_length=255)
    element: int = Field(ge=0, lt=10**4)


_Finite = Annotated[float, Field(allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class _Covariance(_Strict):
    parameters: list[_Parameter] = Field(max_length=2000)
    values: list[list[_Finite]] = Field(max_length=2000)

    @model_validator(mode="after")
    def _one_row_each(self) -> _Covariance:
        count = len(self.parameters)
        if len(self.values) != count or any(len(row) != count for row in self.values):
            raise ValueError("values: a row and a column for every parameter")
        if len({(p.effect, p.name, p.element) for p in self.parameters}) < count:
            raise ValueError("parameters: one twice")
        values = np.array(self.values, float).reshape(count, count)
        if not np.array_equal(values, values.T):
            raise ValueError("values: not symmetric")
        own = np.sqrt(np.maximum(np.diag(values), 0.0))
        own[own == 0.0] = 1.0
        with np.errstate(over="ignore", invalid="ignore"):
            correlations = values / own / own[:, None]
        # Rounding leaves a singular covariance slightly below zero.
        if not np.isfinite(correlations).all() or (
            count and np.linalg.eigvalsh(correlations)[0] < -1e-6 * count
        ):
            raise ValueError("values: a negative variance")
        return self


class _DriveNoise(_Strict):
    powers_w: list[_NotNegative] = Field(min_length=1, max_length=1000)
    spreads_w: list[_NotNegative] = Field(min_length=1, max_length=1000)
    correlation_time_s: _NotNegative
    run_offset_w: _NotNegative
    run_gain: _NotNegative

    @model_validator(mode="after")
    def _ascending(self) -> _DriveNoise:
        if len(self.powers_w) != len(self.spreads_w):
            raise ValueError("spreads_w: one for every power")
        if any(a >= b for a, b in pairwise(self.powers_w)):
            raise ValueError("powers_w: not ascending")
        return self


class _HeldOut(_Strict):
    runs: int = Field(ge=0, lt=10**9)
    scale: float = Field(gt=0.0, allow_inf_nan=False)
    degrees_of_freedom: float = Field(gt=0.0, allow_inf_nan=False)


class _Covered(_Strict):
    speed_mps: _NotNegative
    slope_rad: _NotNegative
    payload_kg: _NotNegative


class _EnergyError(_Strict):
    noise: _DriveNoise
    held_out: _HeldOut
    covered: _Covered | None = None


class _Version(BaseModel):
    version: int = Field(ge=1, lt=10**9)
    action: str = Field(max_length=100)
    adopted: list[str] = []
    before: _Errors | None = None
    after: _Errors | None = None
    noise_floor_w: float | None = Field(default=None, allow_inf_nan=False)
    log: dict[str, Any] | None = None


class SavedModel(BaseModel):
    """All of a saved model that is not the model itself."""

    model_config = ConfigDict(strict=True)

    name: str = Field(min_length=1, max_length=255)
    version: int = Field(ge=1, lt=10**9)
    parent: str | None = Field(max_length=300)
    surfaces: list[str]
    vehicle: dict[str, Any]
    effects: dict[str, Any]
    history: list[_Version] = Field(max_length=10_000)
    covariance: _Covariance | None = None
    energy_error: _EnergyError | None = None

    @classmethod
    def check(cls, document: Any, where: str = "") -> None:
        """Check a saved model.

        Args:
            document: as JSON gives it.
            where: what to call it in an error.

        Raises:
            ModelError: the first thing that cannot be used.
        """
        try:
            cls.model_validate(document)
        except ValidationError as error:
            first = first_complaint(error.errors(include_url=False))
            named = f"{where}: {first.place}" if where else first.place
            raise ModelError(named, first.message.lower(), accepted=ACCEPTED) from None
