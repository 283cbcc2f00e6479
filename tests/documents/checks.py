"""What data in the documents must be: requests, vehicles, maps and mappings that are accepted."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from planner.power.vehicles import load_vehicle
from planner.search.requests import FrontRequest, MatrixRequest, PlanRequest, ReachRequest
from planner.telemetry.logs.mapping import read_mapping
from planner.terrain.catalogue import open_map
from tests.documents.blocks import blocks_of
from tests.documents.given import give

PROBLEM = {"type", "title", "status", "detail"}  # RFC 9457
ENDS = {"map": "warehouse", "start": {"x": 1.5, "y": 2}}
VEHICLE_TABLES = {
    "body",
    "wheels",
    "drive",
    "contact",
    "electronics",
    "limits",
    "battery",
    "effects",
}


def check_json(text: str) -> None:
    """Each document is a request that is accepted, a problem, or GeoJSON."""
    for document in documents(text):
        if "type" in document:
            assert set(document) >= PROBLEM or document["type"].startswith("Feature")
            continue
        kind: Any = PlanRequest
        if "starts" in document:
            kind = MatrixRequest
        elif "points" in document:
            kind = FrontRequest
        elif "energy_j" in document:
            kind = ReachRequest
        kind.from_call(document if "map" in document else {**ENDS, **document}, {})


def documents(text: str) -> Iterator[dict[str, Any]]:
    """JSON documents one after the other."""
    decoder, at = json.JSONDecoder(), 0
    while at < len(text.rstrip()):
        document, at = decoder.raw_decode(text, at)
        yield document
        at += len(text[at:]) - len(text[at:].lstrip())


def check_toml(text: str, file: Path) -> None:
    """A vehicle (some tables of one), a map or a part of one, or a mapping of columns.

    Args:
        text: of the block.
        file: where it was written; a folder if the page gives no name.
    """
    content = tomllib.loads(text)
    if content.keys() & VEHICLE_TABLES:
        if not file.is_file():
            file = file / "block.toml"
            file.write_text(_whole_vehicle(content, text), "utf-8")
        load_vehicle(str(file))
    elif "rows" in content:
        give(file.parent, file.name.replace(".layers.toml", ".asc"))
        assert open_map(str(file).replace(".layers.toml", ".asc")).obstacles.any()
    elif "cell" in content:
        open_map(str(file.with_suffix(".npy")))
    elif content.keys() & {"plan", "heights"}:
        open_map(str(file))
    else:
        assert "columns" in content
        if not file.is_file():
            file = file / "mapping.toml"
            file.write_text(text, "utf-8")
        read_mapping(file)


def _whole_vehicle(part: dict[str, Any], text: str) -> str:
    """Some tables of a vehicle file, completed from the guide's smallest file."""
    (smallest,) = (b.text for b in blocks_of("docs/guide.md") if b.language == "toml")
    for table, entries in tomllib.loads(smallest).items():
        given = part.get(table, {})
        if "layout" in given:
            continue  # the wheels of another layout have other keys
        missing = [f"{key} = {json.dumps(v)}" for key, v in entries.items() if key not in given]
        heading = f"[{table}]"
        if heading not in text:
            text += f"{heading}\n"
        text = text.replace(heading, "\n".join([heading, *missing]))
    return text


def check_yaml(text: str, file: Path) -> None:
    """A picture map that opens."""
    assert "image" in yaml.safe_load(text)
    open_map(str(file))
