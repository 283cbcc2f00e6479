"""A log is known by its bytes."""

from __future__ import annotations

from service.store import Store, log_id, now
from tests.service.store.rows import READ, UPLOAD


def test_the_same_bytes_have_the_same_id_and_another_mapping_another() -> None:
    assert log_id("ab", None) == log_id("ab", None)
    assert len({log_id("ab", None), log_id("ac", None), log_id("ab", b""), log_id("ab", b"x")}) == 4


def test_a_log_is_added_once(store: Store) -> None:
    for name in ("drive.csv", "copy.csv"):
        with store.database.session() as session:
            store.logs.add(session, {**UPLOAD, "name": name}, READ, now())
    assert [log["name"] for log in store.logs.all()] == ["drive.csv"]
    assert store.logs.remove(log_id("ab" * 32, None))
    assert not store.logs.remove(log_id("ab" * 32, None))
    assert store.logs.get(log_id("ab" * 32, None)) is None
