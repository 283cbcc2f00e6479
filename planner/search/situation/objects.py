"""Maps, vehicles and models given as objects where a request has names.

    _, fields, ground, _ = by_name({"map": terrain, "start": (2, 2)}, {}, None, None)
    fields["map"], ground                        # the terrain's name, and the terrain

A request itself holds names only, so that it is the same in Python, in a file and over HTTP.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Any

from planner.errors import RequestError
from planner.power.model import PowerModel
from planner.power.vehicles import Vehicle
from planner.search.requests import RequestLike, SituationRequest
from planner.terrain.heightmap import Terrain


def by_name(
    request: SituationRequest | RequestLike,
    fields: Mapping[str, Any],
    terrain: Terrain | None,
    model: PowerModel | str | PathLike[str] | None,
) -> tuple[SituationRequest | RequestLike, dict[str, Any], Terrain | None, PowerModel | None]:
    """A request as a function takes it, with its objects apart.

    Args:
        request, fields: ``map`` may be a Terrain, ``vehicle`` a Vehicle, ``model`` a PowerModel.
        terrain: instead of the request's map.
        model: instead of the request's vehicle or model; a text or a path is its field ``model``.

    Returns:
        The request without objects, None where it is merged into the fields; the fields over those
        of the request; terrain and model, None where the request's names say which.

    Raises:
        RequestError: both a Vehicle and a model are given.
    """
    given = dict(fields)
    ready = model if isinstance(model, PowerModel) else None
    if terrain is not None:
        given.setdefault("map", terrain)
    # A wrong object is refused with the other fields.
    if model is not None and ready is None:
        given.setdefault("model", model)
    if isinstance(request, Mapping):
        request, given = None, SituationRequest.overridden(request, given)
    if isinstance(given.get("map"), Terrain):
        terrain = given["map"]
        given["map"] = terrain.name
    if isinstance(named := given.get("model"), PowerModel):
        ready, given["model"] = named, named.name
    if isinstance(vehicle := given.get("vehicle"), Vehicle):
        if ready is not None:
            accepted = "one of the two"
            raise RequestError("model", "is given together with vehicle", accepted=accepted)
        given["vehicle"] = vehicle.name
        if given.get("model") is None:
            ready = PowerModel.from_vehicle(vehicle)
    return request, given, terrain if isinstance(terrain, Terrain) else None, ready
