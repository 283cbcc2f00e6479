"""Situations on small maps."""

from __future__ import annotations

from planner.search.requests import PlanRequest
from planner.search.situation import situation_of
from planner.terrain.heightmap import Terrain


def situation_on(relief: Terrain):
    """A map and the usual model, with the field for energy."""
    ends = {"start": {"x": 2.0, "y": 2.0}, "goal": {"x": 4.0, "y": 2.0}}
    found = situation_of(PlanRequest.from_json({"map": "here", **ends}), terrain=relief)
    return found, found.field("energy")
