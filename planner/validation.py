"""The complaints of pydantic, as one sentence in the user's terms.

    except ValidationError as error:
        raise as_request_error(PlanRequest, error) from None

    first = first_complaint(error.errors(include_url=False))    # for sentences of another form
    first.place, first.message

A field that may be of several classes is a tagged union; its tags are ``AMONG`` and a class's name.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from planner.errors import RequestError

AMONG = "one of: "
"""Before the name of a class: tag of what a field holds that may be of several classes."""


@dataclass(frozen=True)
class Complaint:
    """One complaint of pydantic.

    Attributes:
        location: names and indices from the outside in; empty for the whole.
        kind: pydantic's name of it, such as "missing".
        message: pydantic's sentence.
        value: as given.
    """

    location: tuple[int | str, ...]
    kind: str
    message: str
    value: Any

    @property
    def place(self) -> str:
        """The location as ``a.0.b``, at most 80 printable characters."""
        steps = (str(step) for step in self.location)
        return ".".join(step if step.isprintable() else ascii(step) for step in steps)[:80]


def first_complaint(errors: Iterable[Mapping[str, Any]]) -> Complaint:
    """The complaint that a user should hear first.

    Args:
        errors: what ``ValidationError.errors()`` gives, in its order; at least one.
    """
    # A misspelt field explains the one that is missing, so it comes first.
    first = min(errors, key=lambda error: error["type"] != "extra_forbidden")
    message = first["msg"].removeprefix("Value error, ")
    return Complaint(tuple(first["loc"]), first["type"], message, first.get("input"))


def too_deep(asked: type[BaseModel]) -> RequestError:
    """That a request is nested deeper than can be read."""
    return RequestError("request", "is nested too deeply", accepted=fields_of(asked))


def as_request_error(asked: type[BaseModel], error: ValidationError) -> RequestError:
    """The first complaint as one sentence in the user's terms."""
    first = first_complaint(error.errors(include_url=False))
    location, kind = first.location, first.kind
    if kind == "two_models":
        return RequestError(
            "model", first.message, value=first.value.get("model"), accepted="one of the two"
        )
    if kind == "extra_forbidden":
        owner, _ = _declared(asked, location[:-1])
        key = printable(str(location[-1]))
        close = difflib.get_close_matches(key, list(owner.model_fields), n=1)
        hint = f", did you mean {close[0]!r}?" if close else ""
        return RequestError(_path(location), f"no such field{hint}", accepted=fields_of(owner))
    accepted = accepted_at(asked, location)
    if kind == "missing":
        return RequestError(_path(location), "is missing", accepted=accepted)
    problem = problem_of(first, first.message)
    return RequestError(_path(location), problem, value=first.value, accepted=accepted)


def problem_of(complaint: Complaint, otherwise: str) -> str:
    """What is wrong with a value, without what is accepted; ``otherwise`` where no words fit."""
    return _PROBLEMS.get(complaint.kind, otherwise)


def accepted_at(asked: type[BaseModel], location: tuple[int | str, ...]) -> str:
    """What a place in a request accepts: its field's description, or else all fields."""
    _, declared = _declared(asked, location)
    return (declared.description if declared else None) or fields_of(asked)


_PROBLEMS = {
    "float_type": "is not a number",
    "int_parsing": "is not a whole number",
    "float_parsing": "is not a number",
    "bool_type": "is neither true nor false",
    "bool_parsing": "is neither true nor false",
    "string_type": "is not text",
    "string_unicode": "is not valid text",
    "string_too_short": "is empty",
    "string_too_long": "is too long",
    "model_type": "is not an object",
    "dict_type": "is not an object",
    "tuple_type": "is not a list",
    "too_long": "has too many entries",
    "too_short": "has too few entries",
    "literal_error": "is none of the choices",
    "greater_than": "is too small",
    "greater_than_equal": "is too small",
    "less_than": "is too large",
    "less_than_equal": "is too large",
}


def _declared(
    asked: type[BaseModel], location: tuple[int | str, ...]
) -> tuple[type[BaseModel], FieldInfo | None]:
    """The model that owns the last field of a path, and that field's declaration.

    An empty path stands for the request itself.
    """
    inside = asked
    owner, declared = inside, None
    for step in location:
        if isinstance(step, int):
            continue
        if declared is not None and step.startswith(AMONG):
            inside = _model_in(declared.annotation, step.removeprefix(AMONG)) or inside
            continue
        owner = inside
        declared = owner.model_fields.get(step)
        inside = (declared and _model_in(declared.annotation)) or owner
    return (inside, None) if not location else (inside if declared else owner, declared)


def _model_in(annotation: Any, name: str | None = None) -> type[BaseModel] | None:
    """The request's part that an annotation such as ``tuple[PoseRequest, ...]`` speaks of.

    The one of that name where it speaks of several.
    """
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation if name in (None, annotation.__name__) else None
    return next((m for a in get_args(annotation) if (m := _model_in(a, name))), None)


def _path(location: tuple[int | str, ...]) -> str:
    path = ""
    for step in location:
        if isinstance(step, str) and step.startswith(AMONG):
            continue
        if isinstance(step, int):
            path += f"[{step}]"
        else:
            path += ("." if path else "") + printable(step)
    return path or "request"


def printable(key: str) -> str:
    """A key from outside as it can stand in a sentence."""
    text = key if key.isprintable() else ascii(key)
    return text if len(text) <= 60 else text[:57] + "..."


def fields_of(model: type[BaseModel]) -> str:
    """What a part of a request accepts, in words."""
    return "an object with " + ", ".join(model.model_fields)
