"""Places of a request: poses, areas to keep out of, regions to arrive in.

    goal: Goal = Field(...)          # a PoseRequest or a RegionRequest, told apart by its keys

A pose is {"x", "y", "yaw"}, or in short [x, y] or [x, y, yaw]; Python takes tuples and arrays, too.
Metres in the map's frame; yaw in rad, counter-clockwise from the map's x axis, omitted = free.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Tag,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError

from planner.reading import finite_number
from planner.validation import AMONG

CIRCLE_CORNERS = 64
"""Corners of the polygon around a circle; it reaches 0.1 % beyond it."""


def _real(value: Any) -> Any:
    """Numbers of any kind, numpy's among them, but neither booleans nor text."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise PydanticCustomError("not_a_number", "is not a number")
    number = finite_number(value)
    if number is None:
        raise PydanticCustomError("not_finite", "is not a finite number")
    return number


LARGEST_COORDINATE = 1e9
"""m: larger than any map's coordinates, and small enough that areas and distances stay finite."""
Number = Annotated[float, BeforeValidator(_real), Field(allow_inf_nan=False)]
Metres = Annotated[
    float,
    BeforeValidator(_real),
    Field(allow_inf_nan=False, ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE),
]


class Part(BaseModel):
    """A part of a request: no unknown fields, and fixed once it is read."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


def _listed(value: Any) -> Any:
    """Arrays as lists."""
    return value.tolist() if hasattr(value, "tolist") else value


class PoseRequest(Part):
    """A place, and the direction to stand in there."""

    x: Metres
    """metres in the map's frame, -1e9 to 1e9"""
    y: Metres
    """metres in the map's frame, -1e9 to 1e9"""
    yaw: Number | None = None
    """rad counter-clockwise from the map's x axis; left out, the planner chooses"""

    @model_validator(mode="before")
    @classmethod
    def _from_coordinates(cls, value: Any) -> Any:
        value = _listed(value)
        if isinstance(value, list | tuple) and len(value) in (2, 3):
            return dict(zip(("x", "y", "yaw"), value, strict=False))
        if not isinstance(value, Mapping):
            raise PydanticCustomError("no_place", "is not a place")
        return value

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        schema = handler(core_schema)
        fields = handler.resolve_ref_schema(schema)
        written = dict(fields)
        fields.clear()
        numbers_ = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3}
        short = {**numbers_, "title": "Coordinates", "description": "[x, y] or [x, y, yaw]"}
        fields.update(title=written.pop("title"), anyOf=[written, short])
        return schema


Places = Annotated[tuple[PoseRequest, ...], BeforeValidator(_listed)]
"""Poses; an array (n, 2) of x and y, or (n, 3) with the yaw, is read row by row."""


class Area(Part):
    """A circle, or a polygon, that the robot keeps out of."""

    x: Metres | None = None
    """m, the circle's centre, -1e9 to 1e9"""
    y: Metres | None = None
    """m, the circle's centre, -1e9 to 1e9"""
    radius: Metres | None = Field(default=None, gt=0)
    """m, of the circle, above 0 up to 1e9"""
    polygon: Annotated[tuple[tuple[Metres, Metres], ...] | None, BeforeValidator(_listed)] = Field(
        default=None, min_length=3, max_length=1000
    )
    """corners as [x, y] in m, 3 to 1000, such as [[2, 2], [4, 2], [3, 5]]"""

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        self._check_kind()
        return self

    def _check_kind(self) -> None:
        circle = [value is not None for value in (self.x, self.y, self.radius)]
        if all(circle) == (self.polygon is not None) or any(circle) != all(circle):
            raise PydanticCustomError("no_area", "is neither a circle (x, y, radius) nor a polygon")

    def ring(self) -> list[tuple[float, float]]:
        """Corners in m, the first one again at the end; a polygon round the whole of a circle."""
        if self.polygon is not None:
            corners = [(float(x), float(y)) for x, y in self.polygon]
        else:
            assert self.x is not None  # checked with the request
            assert self.y is not None
            assert self.radius is not None
            # numpy is slow to import: checking a request does without it.
            import numpy as np

            # Round the circle, so that nothing of it is left out.
            reach = self.radius / math.cos(math.pi / CIRCLE_CORNERS)
            angles = 2.0 * math.pi * (np.arange(CIRCLE_CORNERS) + 0.5) / CIRCLE_CORNERS
            corners = [
                (self.x + reach * math.cos(angle), self.y + reach * math.sin(angle))
                for angle in angles
            ]
        return [*corners, corners[0]]


class RegionRequest(Area):
    """A circle or a polygon to arrive in, or any of several places."""

    # A place alone is no region in the JSON schema either.
    model_config = ConfigDict(
        json_schema_extra={
            "anyOf": [
                {"required": ["x", "y", "radius"]},
                {"required": ["polygon"]},
                {"required": ["any"]},
            ]
        }
    )

    yaw: Number | None = Field(
        default=None,
        description="rad counter-clockwise from the map's x axis, to arrive with in a circle or "
        "polygon; left out, the planner chooses",
    )
    any: Places | None = Field(
        default=None,
        min_length=1,
        max_length=100,
        description='1 to 100 places of which one will do, such as [[2, 3], {"x": 8, "y": 1, '
        '"yaw": 0}]',
    )

    def _check_kind(self) -> None:
        area = (self.x, self.y, self.radius, self.polygon, self.yaw)
        if self.any is None:
            super()._check_kind()
        elif any(value is not None for value in area):
            raise PydanticCustomError("two_goals", "has other fields beside any")


def goal_kind(value: Any) -> str:
    """Tag of what a goal is given as: a place, or a region of places."""
    region = isinstance(value, RegionRequest)
    if isinstance(value, Mapping):
        region = bool({"radius", "polygon", "any"} & value.keys())
    return AMONG + (RegionRequest if region else PoseRequest).__name__


Goal = Annotated[
    Annotated[PoseRequest, Tag(AMONG + "PoseRequest")]
    | Annotated[RegionRequest, Tag(AMONG + "RegionRequest")],
    Discriminator(goal_kind),
]
"""A place, or a region of places."""
