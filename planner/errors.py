"""Errors, and the sentences that report them.

    JoulepathError
    ├── InputError          something given cannot be used: which, what is wrong, what would do
    │   ├── RequestError    a field of a route request
    │   ├── MapError        a heightmap or its catalogue entry
    │   ├── VehicleError    a vehicle's TOML file
    │   ├── ModelError      a saved power model
    │   └── LogError        a telemetry log
    ├── MissingPackage      an optional package is not installed
    └── Cancelled           the caller asked to stop

Every InputError is one sentence that names the field, the value and what would be accepted. The
command line turns it into exit code 2, the service into a problem+json document of status 422.
"""

from __future__ import annotations

from typing import Any


class JoulepathError(Exception):
    """Base of everything that joulepath raises on purpose."""


class InputError(JoulepathError):
    """Something given cannot be used.

    Args:
        field: which input, as the user wrote it ("start.x", a file's path, "[drive] resistance").
        problem: what is wrong with it, without the value.
        value: the value as given; left out of the sentence when it is None.
        accepted: what would be accepted instead.
    """

    def __init__(self, field: str, problem: str, *, value: Any = None, accepted: str) -> None:
        self.field = field
        self.problem = problem
        self.value = value
        self.accepted = accepted
        got = "" if value is None else f" (got {short(value)})"
        super().__init__(f"{field}: {problem}{got}; accepted: {accepted}")

    def __reduce__(self) -> tuple[Any, ...]:
        # Errors cross process borders; keyword arguments need their own way to be rebuilt.
        return _rebuild, (type(self), self.field, self.problem, self.value, self.accepted)


def _rebuild(
    kind: type[InputError], field: str, problem: str, value: Any, accepted: str
) -> InputError:
    return kind(field, problem, value=value, accepted=accepted)


def short(value: Any) -> str:
    """A value as it can stand in a sentence, at most 80 characters."""
    try:
        text = repr(value)
    except ValueError:
        # The interpreter prints no whole number of more than some thousand digits.
        return "a number with too many digits"
    text = " ".join(text.split()) if "\n" in text else text
    return text if len(text) <= 80 else text[:77] + "..."


class RequestError(InputError):
    """A field of a route request."""


class MapError(InputError):
    """A heightmap, its format or its catalogue entry."""


class VehicleError(InputError):
    """A vehicle's name or TOML file."""


class ModelError(InputError):
    """A saved power model."""


class LogError(InputError):
    """A telemetry log."""


class MissingPackage(JoulepathError):
    """An optional package is not installed.

    Args:
        package: that is needed.
        extra: of joulepath that installs it.
    """

    def __init__(self, package: str, extra: str) -> None:
        self.package, self.extra = package, extra
        super().__init__(f'{package} is not installed; pip install "joulepath[{extra}]"')

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.package, self.extra)


class Cancelled(JoulepathError):
    """The caller asked to stop; nothing was written."""
