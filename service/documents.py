"""Results as strict JSON documents: what JSON cannot represent is null.

A capacity that is not limited or a bound that does not exist is an infinity in Python and null in
JSON. Numbers of a route are finite; an infinity among them would be an error, so a route is
written with ``strict``.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from planner.errors import InputError


def finite(document: Any) -> Any:
    """The same document with lists for arrays, and null for every number that is not finite."""
    if isinstance(document, float):
        return document if math.isfinite(document) else None
    if isinstance(document, dict):
        return {key: finite(value) for key, value in document.items()}
    if isinstance(document, list | tuple):
        return [finite(value) for value in document]
    return finite(document.tolist()) if hasattr(document, "tolist") else document


def strict(document: Any) -> str:
    """JSON text.

    Raises:
        ValueError: a number is not finite.
    """
    return json.dumps(document, allow_nan=False, ensure_ascii=False)


def route_document(document: dict[str, Any]) -> dict[str, Any]:
    """ROUTE.json for ``strict``; its ``planner`` may hold infinities, the route may not."""
    return {**document, "planner": finite(document["planner"])}


def model_text(model: Any) -> str:
    """A power model as PowerModel.save writes it into a file."""
    return json.dumps(model.document(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write_whole(path: Path, text: str) -> None:
    """Write a file so that a reader sees all of it or none of it.

    Raises:
        InputError: it cannot be written.
    """
    unfinished = path.with_name(path.name + ".unfinished")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(path)
    except OSError as error:
        problem = f"cannot be written: {error.strerror or error}"
        accepted = "a file in a folder that can be written"
        raise InputError(str(path), problem, accepted=accepted) from None
