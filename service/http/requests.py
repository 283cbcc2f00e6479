"""What the workbench's endpoints are asked with."""

from __future__ import annotations

import json
from typing import Annotated, Any

from fastapi import Query
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

Name = Annotated[str, Field(min_length=1, max_length=1024)]

Wait = Annotated[
    float,
    Query(ge=0, le=600, description="seconds to wait for the result; without it a job is answered"),
]


Report = Annotated[bool, Query(description="add `report`: its pictures and tables as HTML")]


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class CompareRequest(_Asked):
    """A log, and what to start from: a vehicle's base model, fitted, or a saved model."""

    log: Name = Field(description="id of a log, out of GET /v1/logs", examples=["5f2d0c1b7a9e4433"])
    vehicle: Name | None = Field(
        default=None,
        description="a name out of GET /v1/vehicles; its base model is fitted to the log",
        examples=["minibalance"],
    )
    model: Name | None = Field(
        default=None, description="id of a saved model, out of GET /v1/models, instead of a vehicle"
    )

    @model_validator(mode="after")
    def _one_start(self) -> CompareRequest:
        if (self.vehicle is None) == (self.model is None):
            raise ValueError("exactly one of vehicle and model has to be given")
        return self


class DiagnoseRequest(CompareRequest):
    """The same as for a comparison."""


class AdoptRequest(CompareRequest):
    """Beside log and start, what to adopt."""

    effects: tuple[Name, ...] = Field(
        default=(),
        max_length=40,
        description='names of effects, or ["diagnosed"] for all that the diagnosis selects and '
        "proposes",
        examples=[["air_drag"]],
    )
    formula: dict[str, Any] | None = Field(
        default=None,
        description="definition of a custom effect (name, formula, unit, parameters); adopted "
        "under its name, which is among the effects or stands alone",
    )

    @field_validator("effects", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        return [part.strip() for part in value.split(",")] if isinstance(value, str) else value

    @field_validator("formula")
    @classmethod
    def _plain_json(cls, value: dict[str, Any] | None) -> dict[str, Any] | None:
        try:
            json.dumps(value, allow_nan=False, ensure_ascii=False).encode()
        except ValueError:
            raise ValueError("holds what strict JSON cannot say") from None
        return value

    @model_validator(mode="after")
    def _something(self) -> AdoptRequest:
        if not self.effects and self.formula is None:
            raise ValueError("effects or formula has to be given")
        return self


class RevertRequest(_Asked):
    """Which version to go back to."""

    version: int = Field(ge=1, description="a version in the model's history", examples=[2])
