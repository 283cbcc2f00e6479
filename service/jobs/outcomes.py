"""Results of jobs that are more than text.

The service's own process unpickles it and so loads this module: nothing of the planner stands here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Catalogues:
    """What is installed: lists of objects that have a ``name``."""

    maps: list[dict[str, Any]]
    vehicles: list[dict[str, Any]]
    effects: list[dict[str, Any]]
    kinds: tuple[str, ...]


@dataclass(frozen=True)
class Adopted:
    """An adoption's document, and the text of the new version of the model."""

    document: dict[str, Any]
    model: str
