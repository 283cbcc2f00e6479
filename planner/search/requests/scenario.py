"""What every request says: ground, robot and circumstances, read and checked field by field.

    class PlanRequest(SituationRequest): ...           # questions
    request = PlanRequest.from_text('{"map": "warehouse", "start": {"x": 1, "y": 1}, ...}')

Metres in the map's frame, yaw in rad (counter-clockwise from the map's x axis), omitted = free.
The same object serves Python, the command line and HTTP; each field's description is its line in
the JSON schema and what an error says would be accepted. Whether the map and the vehicle exist and
whether the start is on ground that can be held is for the planner to find out.
"""

from __future__ import annotations

import json
import numbers
from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from planner.errors import RequestError
from planner.search.requests.places import Area, Number, Part
from planner.validation import as_request_error, fields_of, printable, too_deep

DEFAULT_VEHICLE = "minibalance"
RequestLike = Mapping[str, Any] | str | PathLike[str] | None
"""A mapping of a request's fields, the path of a REQUEST.json, or nothing."""


def _whole(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise PydanticCustomError("not_whole", "is not a whole number")
    return int(value)


def _plain_text(value: str) -> str:
    if not value.isprintable():
        raise PydanticCustomError("not_plain", "holds characters that cannot be printed")
    return value


Whole = Annotated[int, BeforeValidator(_whole)]
Name = Annotated[
    str,
    Field(min_length=1, max_length=1024),
    BeforeValidator(lambda value: fspath(value) if isinstance(value, PathLike) else value),
    AfterValidator(_plain_text),
]


class Payload(Part):
    """What the robot carries, as one body."""

    mass: Number = Field(default=0.0, ge=0)
    """kg, a number of at least 0"""
    x: Number = 0.0
    """m forward of the robot's geometric centre, a finite number"""
    y: Number = 0.0
    """m left of the robot's geometric centre, a finite number"""
    height: Number | None = Field(default=None, ge=0)
    """m from the ground to the payload's centre of mass; left out, that of the robot's own"""


class Wind(Part):
    """Velocity of the air over the ground."""

    x: Number = Field(default=0.0, ge=-100, le=100)
    """m/s along the map's x, -100 to 100"""
    y: Number = Field(default=0.0, ge=-100, le=100)
    """m/s along the map's y, -100 to 100"""


class Conditions(Part):
    """Conditions that hold for the whole route; what is left out takes the model's reference."""

    motor_temp: Number | None = Field(default=None, ge=-60, le=250)
    """motors at the start, °C, -60 to 250"""
    ambient_temp: Number | None = Field(default=None, ge=-60, le=85)
    """air, °C, -60 to 85"""
    wind: Wind = Wind()
    """the air's velocity in m/s, such as {"x": 3, "y": 0}"""
    sensor_rate: Number | None = Field(default=None, ge=0, le=1e6)
    """samples per second, Hz, 0 to 1000000"""
    battery_voltage: Number | None = Field(default=None, gt=0, le=2000)
    """V at the battery, above 0 up to 2000"""
    battery_charge: Number | None = Field(default=None, ge=0, le=1)
    """share of the battery's capacity, 0 to 1"""


class SituationRequest(Part):
    """Over which ground, with which robot, under which circumstances."""

    default_vehicle: ClassVar[str] = DEFAULT_VEHICLE
    """Of a request that names neither a vehicle nor a model."""

    map: Name = Field(examples=["jacksboro-1to100"])
    """a name out of the catalogue of maps, or the path of a map's file"""
    vehicle: Name | None = Field(
        default=None,
        description="a name out of the catalogue of vehicles, or the path of a vehicle's TOML; "
        f"{DEFAULT_VEHICLE} when neither vehicle nor model is given",
        examples=[DEFAULT_VEHICLE],
    )
    model: Name | None = None
    """path of a saved power model, instead of a vehicle"""
    payload: Payload = Payload()
    """what it carries, such as {"mass": 5, "x": 0.1}"""
    conditions: Conditions = Conditions()
    """circumstances, such as {"motor_temp": 60, "wind": {"x": 3}}"""

    avoid: tuple[Area, ...] = Field(
        default=(),
        max_length=100,
        description='up to 100 areas to keep out of, such as [{"x": 5, "y": 5, "radius": 2}, '
        '{"polygon": [[2, 2], [4, 2], [3, 5]]}]',
    )

    @model_validator(mode="before")
    @classmethod
    def _one_source_of_the_model(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        if data.get("vehicle") is None and data.get("model") is None:
            return {**data, "vehicle": DEFAULT_VEHICLE}
        if data.get("vehicle") is not None and data.get("model") is not None:
            raise PydanticCustomError("two_models", "is given together with vehicle")
        return data

    @classmethod
    def from_json(cls, document: Any) -> Self:
        """Check a request that is already parsed.

        Args:
            document: a mapping of the fields above, as json.loads or a Python caller gives it.

        Raises:
            RequestError: the first field that cannot be used.
        """
        if not isinstance(document, Mapping):
            raise RequestError(
                "request", "is not a JSON object", value=document, accepted=fields_of(cls)
            )
        try:
            return cls.model_validate({str(key): value for key, value in document.items()})
        except ValidationError as error:
            raise as_request_error(cls, error) from None
        except RecursionError:
            raise too_deep(cls) from None

    @classmethod
    def from_call(cls, request: SituationRequest | RequestLike, fields: Mapping[str, Any]) -> Self:
        """A request as a function takes it, with keywords laid over it.

        Args:
            request: ready, a mapping of its fields, the path of a REQUEST.json, or None.
            fields: replace those of the request.

        Raises:
            RequestError: the file cannot be read, or the first field that cannot be used.
        """
        if isinstance(request, str | PathLike):
            return cls.from_file(request, fields)
        if isinstance(request, cls) and not fields:
            return request
        if isinstance(request, SituationRequest):
            request = request.model_dump(exclude_unset=isinstance(request, cls))
        return cls.from_json(cls.overridden({} if request is None else request, fields))

    @staticmethod
    def overridden(document: Any, overrides: Mapping[str, Any]) -> Any:
        """Fields laid over an object; a vehicle over a model, or the reverse, replaces it."""
        if not overrides or not isinstance(document, Mapping):
            return document
        replaced = {"vehicle", "model"} if {"vehicle", "model"} & overrides.keys() else set()
        return {k: v for k, v in document.items() if k not in replaced} | dict(overrides)

    @classmethod
    def from_file(
        cls, path: str | PathLike[str], overrides: Mapping[str, Any] | None = None
    ) -> Self:
        """Check a request in a file; paths in it are relative to the working directory.

        Args:
            path: of a REQUEST.json.
            overrides: fields that replace those of the file.

        Raises:
            RequestError: the file cannot be read, or as ``from_text``.
        """
        try:
            content = Path(path).read_bytes()
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or "no file has such a name"
            name = str(path)
            raise RequestError(
                name if name.isprintable() else ascii(name),
                f"cannot be read: {reason}",
                accepted="the path of a REQUEST.json",
            ) from None
        try:
            return cls.from_text(content, overrides)
        except RequestError as error:
            if error.field != "request" or Path(path).suffix.lower() in ("", ".json"):
                raise
            accepted = "the path of a REQUEST.json; a map goes into its field map, or after --map"
            raise RequestError(str(path), error.problem, accepted=accepted) from None

    @classmethod
    def from_text(cls, text: str | bytes, overrides: Mapping[str, Any] | None = None) -> Self:
        """Check a request given as JSON text.

        Args:
            text: one JSON object, UTF-8.
            overrides: fields that replace those of the text.

        Raises:
            RequestError: not JSON, a field given twice, or a field that cannot be used.
        """
        try:
            if isinstance(text, bytes):
                text = text.decode("utf-8-sig")
            document = json.loads(text, object_pairs_hook=_without_duplicates)
        except UnicodeDecodeError as error:
            problem = f"is not UTF-8 text: byte {error.start}"
        except json.JSONDecodeError as error:
            problem = f"is not JSON: {error.msg} in line {error.lineno}, column {error.colno}"
        except ValueError:
            # The interpreter refuses to read whole numbers of more than some thousand digits.
            many = "holds a number with too many digits"
            raise RequestError("request", many, accepted="finite numbers") from None
        except RecursionError:
            raise too_deep(cls) from None
        else:
            return cls.from_json(cls.overridden(document, overrides or {}))
        raise RequestError("request", problem, accepted=fields_of(cls))


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise RequestError(printable(key), "is given twice", accepted="every field once")
        result[key] = value
    return result
