"""The frame of a saved model's file: names, numbers of versions, history.

    SavedModel.check(document, where)

PowerModel.from_document reads the rest: effects, parameters and the vehicle.
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

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
    """All of a saved model that is not the model itself."""

    model_config = ConfigDict(strict=True)

    name: str = Field(min_length=1, max_length=255)
    version: int = Field(ge=1, lt=10**9)
    parent: str | None = Field(max_length=300)
    surfaces: list[str]
    vehicle: dict[str, Any]
    effects: dict[str, Any]
    history: list[_Version] = Field(max_length=10_000)

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
            first = error.errors(include_url=False)[0]
            place = ".".join(str(step) for step in first["loc"])
            named = f"{where}: {place}" if where else place
            raise ModelError(named, first["msg"].lower(), accepted=ACCEPTED) from None
