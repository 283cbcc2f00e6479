"""Numbers and TOML from outside, read so that nothing in them can fail later.

    number = finite_number(raw)              # None where it is not a finite number
    document = parse_toml(path.read_bytes()) # ValueError with a reason that a user can read

TOML, YAML, JSON and Python give whole numbers of any length. ``float`` raises OverflowError for
those of more than 308 digits, and the interpreter reads and prints no more than some thousand.
"""

from __future__ import annotations

import math
import numbers
import tomllib
from typing import Any


def finite_number(value: Any) -> float | None:
    """The value as a finite float; None for booleans, text, NaN, infinity and too many digits."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def parse_toml(content: bytes) -> dict[str, Any]:
    """A TOML document.

    Args:
        content: UTF-8, with or without a byte-order mark.

    Raises:
        ValueError: it is not TOML; the message is one phrase that says why and where.
    """
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except tomllib.TOMLDecodeError:
        raise
    except UnicodeDecodeError as error:
        raise ValueError(f"byte {error.start} is not UTF-8") from error
    except ValueError as error:
        # The interpreter's own sentence advises programmers how to raise its limit of digits.
        raise ValueError("a number has too many digits") from error
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
