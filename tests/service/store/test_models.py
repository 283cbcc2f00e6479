"""Versions of models and their history."""

from __future__ import annotations

import json

from service.store import Store, now
from tests.service.telemetry_documents import entry, model_document


def test_history_knows_the_versions_that_are_here(store: Store) -> None:
    first = store.models.save(json.dumps(model_document(2)), None, now())
    second = store.models.save(json.dumps(model_document(3)), first["id"], now())
    entries = store.models.history(second["id"])
    assert entries is not None
    assert [(e["version"], e["id"]) for e in entries] == [(2, first["id"]), (3, second["id"])]
    assert "snapshot" not in entries[0]
    assert store.models.history("nothing") is None
    # A version whose forebears were adopted elsewhere.
    alone = store.models.save(json.dumps(model_document(3)), None, now())
    entries = store.models.history(alone["id"])
    assert entries is not None
    assert [e["id"] for e in entries] == [None, alone["id"]]


def test_lists_of_models_say_what_a_version_is_worth(store: Store) -> None:
    saved = model_document(2, history=[entry(2)])
    store.models.save(json.dumps(saved), None, now())
    (listed,) = store.models.all()
    assert (listed["version"], listed["adopted"]) == (2, ["air_drag"])
    assert (listed["heldout_rmse_w"], listed["noise_floor_w"]) == (0.52, 0.5)
    assert listed["effects"] == ["electronics"]
