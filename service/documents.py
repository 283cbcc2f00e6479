"""Results as JSON documents, strictly: what JSON cannot say is left empty.

A capacity that is not limited or a bound that does not exist is an infinity in Python and null in
JSON. Numbers of a route are finite; an infinity among them would be an error, so a route is
written with ``strict``.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any


def finite(document: Any) -> Any:
    """The same document with null for every number that is not finite."""
    if isinstance(document, float):
        return document if math.isfinite(document) else None
    if isinstance(document, dict):
        return {key: finite(value) for key, value in document.items()}
    if isinstance(document, list | tuple):
        return [finite(value) for value in document]
    return document


def strict(document: Any) -> str:
    """JSON text.

    Raises:
        ValueError: a number is not finite.
    """
    return json.dumps(document, allow_nan=False, ensure_ascii=False)


def route_text(document: dict[str, Any]) -> str:
    """ROUTE.json as text; what its planner says of itself may hold infinities, the route may not.

    Raises:
        ValueError: a number of the route is not finite.
    """
    return strict({**document, "planner": finite(document["planner"])})


def write_whole(path: Path, text: str) -> None:
    """Write a file so that a reader sees all of it or none of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(path.name + ".unfinished")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(path)
