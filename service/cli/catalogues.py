"""The commands that list what is installed: ``maps``, ``vehicles`` and ``effects``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import typer

from service import documents
from service.cli.terminal import Json, Verbose, show


def maps(json_: Json = False, verbose: Verbose = False) -> None:
    """List the maps of the catalogue."""
    from planner.terrain.catalogue import list_maps

    columns = {"name": "name", "title": "what", "size": "size (m)", "cell": "cell (m)"}
    _list(list_maps(), columns, "Maps", json_)


def vehicles(json_: Json = False, verbose: Verbose = False) -> None:
    """List the vehicles."""
    from planner.power.vehicles import list_vehicles

    columns = {"name": "name", "title": "what", "mass_kg": "kg", "wheels": "wheels"}
    _list(list_vehicles(), columns, "Vehicles", json_)


def effects(json_: Json = False, verbose: Verbose = False) -> None:
    """List the physical effects that a power model can hold."""
    from planner.power.catalogue import list_effects

    columns = {"name": "name", "title": "what", "stages": "acts on", "base": "in every model"}
    _list(list_effects(), columns, "Effects", json_)


VERBS: tuple[Callable[..., None], ...] = (maps, vehicles, effects)


def _list(
    entries: Sequence[dict[str, Any]], columns: dict[str, str], title: str, as_json: bool
) -> None:
    plain = documents.finite(list(entries))
    if as_json:
        typer.echo(documents.strict(plain))
    else:
        from service.cli.route_tables import catalogue

        show(catalogue(plain, columns, title))
