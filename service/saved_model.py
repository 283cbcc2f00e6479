"""What the service itself reads in a saved model; the planner reads all of it.

SavedModel.check(text)
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Field, ValidationError

from planner.errors import ModelError

ACCEPTED = "a file that joulepath adopt wrote"


class _Errors(BaseModel):
    rmse_w: float | None = Field(default=None, allow_inf_nan=False)
    heldout_rmse_w: float | None = Field(default=None, allow_inf_nan=False)


class _Version(BaseModel):
    version: int = Field(ge=1, lt=10**9)
    action: str = Field(max_length=100)
    adopted: list[str] = []
    before: _Errors | None = None
    after: _Errors | None = None
    noise_floor_w: float | None = Field(default=None, allow_inf_nan=False)
    log: dict[str, Any] | None = None


class SavedModel(BaseModel):
    """What the service itself reads in a saved model; the planner checks the rest."""

    name: str = Field(min_length=1, max_length=255)
    version: int = Field(ge=1, lt=10**9)
    vehicle: dict[str, Any]
    effects: dict[str, Any]
    history: list[_Version] = Field(max_length=10_000)

    @classmethod
    def check(cls, text: str) -> None:
        """Check the text of a saved model.

        Raises:
            ModelError: the first thing that cannot be used.
        """
        try:
            cls.model_validate_json(text)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            where = ".".join(str(step) for step in first["loc"])
            raise ModelError(where, first["msg"].lower(), accepted=ACCEPTED) from None
