"""What the service keeps survives a restart."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from planner.errors import InputError
from service.settings import Settings
from service.store import Store, now
from tests.service.store.rows import READ, UPLOAD, done
from tests.service.telemetry_documents import model_document


def restarted(store: Store, settings: Settings) -> Store:
    """The store as the next service finds it."""
    store.close()
    return Store.open(settings)


def test_everything_survives_a_restart(store: Store, settings: Settings) -> None:
    with store.database.session() as session:
        store.logs.add(session, UPLOAD, READ, now())
    text = json.dumps(model_document(), indent=2) + "\n"
    model = store.models.save(text, None, now())
    job = store.jobs.create("compare", {"log": "x"})
    assert store.jobs.begin(job["id"], until=1e12)
    assert store.jobs.finish(job["id"], done) == {"rmse_w": 2.0}
    again = restarted(store, settings)
    try:
        assert [log["name"] for log in again.logs.all()] == ["drive.csv"]
        assert again.models.document(model["id"]) == text
        kept = again.jobs.get(job["id"])
        assert kept is not None
        assert (kept["state"], kept["result"]) == ("done", {"rmse_w": 2.0})
        assert kept["created_at"] <= kept["started_at"] <= kept["finished_at"]
    finally:
        again.close()


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="JOULEPATH_STORE_DIR"):
        Store.open(Settings(store_dir=tmp_path / "file"))
