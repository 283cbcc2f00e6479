"""Names in requests from outside: catalogue entries, stored models, files of a folder.

On the command line a map, a vehicle or a model may be any path. Over HTTP it is a name in the
catalogue, the id of a stored model, or a file inside the folder JOULEPATH_DATA_DIR.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from planner.errors import RequestError
from planner.reading import parse_toml
from planner.search.requests import SituationRequest

SUFFIXES = {
    "map": (".tif", ".tiff", ".asc", ".npy", ".npz", ".yaml", ".yml", ".toml"),
    "vehicle": (".toml",),
    "model": (".json",),
}


MAP_FILE = "map.toml"
"""Makes a folder a map of several files, see planner.terrain.formats."""
MAP_KEYS = {"plan", "heights"}
"""One of these a map's TOML has, and no vehicle's."""
MAPPING_KEYS = {"columns", "constants", "rosbag", "power_at"}
"""One of these the mapping file of a log has, see docs/logs.md, and no vehicle's TOML."""
LONGEST_TOML = 1 << 20
"""Bytes of a TOML file that are looked at."""

Asked = TypeVar("Asked", bound=SituationRequest)


@dataclass(frozen=True)
class Names:
    """What requests may name, by field of the request.

    Attributes:
        catalogue: built-in names of the planner.
        folder: with further files, or None.
        stored: path of the file of a stored model by its id, or None.
    """

    catalogue: dict[str, Collection[str]]
    folder: Path | None
    stored: Callable[[str], Path | None] = lambda _: None

    def resolve(self, request: Asked) -> Asked:
        """The same request with names inside the folder replaced by their paths.

        Raises:
            RequestError: a name is neither in the catalogue nor in the folder.
        """
        paths = {
            field: self.find(field, name)
            for field in SUFFIXES
            if (name := getattr(request, field)) is not None
        }
        return request.model_copy(update=paths)

    def find(self, field: str, name: str) -> str:
        """A name in the catalogue unchanged, or the path of a stored model or a file in the folder.

        Raises:
            RequestError: it is neither.
        """
        if name in self.catalogue[field]:
            return name
        if field == "model" and (path := self.stored(name)) is not None:
            return str(path)
        if name in self.files(field) and self.folder is not None:
            return str(self.folder.resolve() / name)
        ids = ["an id from GET /v1/models"] if field == "model" else []
        known = [*self.catalogue[field], *self.files(field), *ids]
        raise RequestError(
            field, f"no such {field} in this service", value=name, accepted=", ".join(known)
        )

    def files(self, field: str) -> list[str]:
        """What a field may name in the folder, files and maps that are folders, relative to it."""
        if self.folder is None:
            return []
        folder = self.folder.resolve()
        # Links that lead out of the folder are not files of the folder.
        return sorted(
            str(path.relative_to(folder))
            for path in folder.rglob("*")
            if _fits(field, path) and path.resolve().is_relative_to(folder)
        )


def _fits(field: str, path: Path) -> bool:
    """Whether a path may be meant by a field; a map of several files is its folder or its TOML."""
    if path.is_dir():
        return field == "map" and (path / MAP_FILE).is_file()
    if path.name == MAP_FILE or not path.is_file():
        return False
    if path.suffix.lower() == ".toml":
        return field == _meant_by_toml(path)
    return path.suffix.lower() in SUFFIXES[field]


def _meant_by_toml(path: Path) -> str | None:
    """The field that a TOML file is for; None for one that no request names.

    A file that cannot be read is a vehicle's: asked for, it says what is wrong with it.
    """
    try:
        with path.open("rb") as file:
            content = parse_toml(file.read(LONGEST_TOML))
    except (OSError, ValueError):
        return "vehicle"
    if not MAP_KEYS.isdisjoint(content):
        return "map"
    return None if not MAPPING_KEYS.isdisjoint(content) else "vehicle"
