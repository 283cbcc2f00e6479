"""Definitions of custom effects in files.

definition = read_definition(Path("tow.toml"))
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner.errors import ModelError

MOST_DEFINITION = 65_536  # bytes of a custom effect's file
_DEFINITION = (
    "a JSON or TOML file with name, formula, unit and parameters of a custom effect, "
    "see docs/custom-effects.md"
)


def read_definition(path: Path) -> Mapping[str, Any]:
    """The definition of a custom effect from a JSON or TOML file.

    Raises:
        ModelError: the file cannot be read or holds no definition.
    """
    where = str(path)
    try:
        with path.open("rb") as file:
            content = file.read(MOST_DEFINITION + 1)
    except OSError as error:
        raise ModelError(where, f"cannot be read: {error.strerror}", accepted=_DEFINITION) from None
    if len(content) > MOST_DEFINITION:
        raise ModelError(where, f"is larger than {MOST_DEFINITION} bytes", accepted=_DEFINITION)
    toml = path.suffix.lower() == ".toml"
    try:
        text = content.decode("utf-8-sig")
        definition = tomllib.loads(text) if toml else json.loads(text)
    except (ValueError, RecursionError) as error:
        kind = "TOML" if toml else "JSON"
        raise ModelError(where, f"is not {kind}: {error}", accepted=_DEFINITION) from None
    if not isinstance(definition, Mapping):
        raise ModelError(where, "is not an object", accepted=_DEFINITION)
    return definition
