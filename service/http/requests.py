"""Requests of the workbench's endpoints."""

from __future__ import annotations

import json
from typing import Annotated, Any

from fastapi import Query
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

Name = Annotated[str, Field(min_length=1, max_length=1024)]

Wait = Annotated[
    float,
    Query(
        ge=0, le=600, description="seconds to wait for the result; after that, the job is returned"
    ),
]


Report = Annotated[bool, Query(description="add `report`: its pictures and tables as HTML")]
Files = Annotated[bool, Query(description="add `files`: the routes in every other format, as text")]
BaselinePoses = Annotated[bool, Query(description="add `poses` to the baselines")]
WithProgress = Annotated[
    bool, Query(description="answer in lines of JSON: `progress` while it works, then `answer`")
]


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class CompareRequest(_Asked):
    """A log and the initial model: a vehicle's fitted base model, or a saved model."""

    log: Name = Field(examples=["5f2d0c1b7a9e4433"])
    """id of a log from GET /v1/logs"""
    vehicle: Name | None = Field(None, examples=["minibalance"])
    """name from GET /v1/vehicles; its base model is fitted to the log"""
    model: Name | None = None
    """id of a saved model from GET /v1/models, instead of a vehicle"""

    @model_validator(mode="after")
    def _one_start(self) -> CompareRequest:
        if (self.vehicle is None) == (self.model is None):
            raise ValueError("exactly one of vehicle and model is required")
        return self


class DiagnoseRequest(CompareRequest):
    """The same fields as for a comparison."""


class AdoptRequest(CompareRequest):
    """A log, the initial model, and the effects to adopt."""

    effects: tuple[Name, ...] = Field((), max_length=40, examples=[["air_drag"]])
    """names of effects, or ["diagnosed"] for all effects that the diagnosis selects or proposes"""
    formula: dict[str, Any] | None = None
    """definition (name, formula, unit, parameters) of a custom effect, adopted under its name"""

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
            raise ValueError("holds values that strict JSON cannot represent") from None
        return value

    @model_validator(mode="after")
    def _something(self) -> AdoptRequest:
        if not self.effects and self.formula is None:
            raise ValueError("effects or formula is required")
        return self


class RevertRequest(_Asked):
    """The version to go back to."""

    version: int = Field(ge=1, examples=[2])
    """version in the model's history"""
