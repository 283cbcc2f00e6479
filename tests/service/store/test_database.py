"""A database that cannot be used, or is held by another program."""

from __future__ import annotations

import errno
import sqlite3

import pytest
from sqlalchemy.exc import OperationalError

from planner.errors import InputError
from service.problems import DatabaseLocked
from service.settings import Settings
from service.store import Store
from service.store import database as databases
from service.store.database import Database
from tests.service.conftest import locked


@pytest.mark.parametrize(
    "url", ["nonsense", "nosuchdatabase://host/x", "sqlite:////nonexistent/folder/x.db"]
)
def test_an_address_that_cannot_be_used_is_one_sentence(url: str) -> None:
    with pytest.raises(InputError) as caught:
        Database(url)
    assert caught.value.field == "JOULEPATH_DATABASE_URL"
    assert "\n" not in str(caught.value)


def test_a_locked_database_is_read_and_not_changed(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(databases, "LOCK_PATIENCE_S", 0)
    store = Store.open(settings)
    job = store.jobs.create("compare", {})
    with locked(store.files.folder):
        # A service that starts now finds its tables, too.
        again = Store.open(settings)
        assert again.jobs.queued() == [job["id"]]
        with pytest.raises(DatabaseLocked):
            again.jobs.begin(job["id"], until=1e12)
        # There is nothing to give up, and still it is known that nobody could renew a lease.
        with pytest.raises(DatabaseLocked):
            again.jobs.give_up_dead(at=0.0)
        again.close()
    assert store.jobs.begin(job["id"], until=1e12)
    store.close()


@pytest.mark.parametrize(
    ("code", "meaning"),
    [
        (sqlite3.SQLITE_BUSY, DatabaseLocked),
        (sqlite3.SQLITE_BUSY_SNAPSHOT, DatabaseLocked),
        (sqlite3.SQLITE_LOCKED, DatabaseLocked),
        (sqlite3.SQLITE_FULL, OSError),
        (sqlite3.SQLITE_CORRUPT, OperationalError),
        (None, DatabaseLocked),
    ],
)
def test_what_a_failure_of_the_database_means(
    store: Store, code: int | None, meaning: type[Exception]
) -> None:
    """One of another database, which says no code, is that it cannot be reached."""
    reason = sqlite3.OperationalError("as the test says") if code is not None else OSError("gone")
    if isinstance(reason, sqlite3.Error) and code is not None:
        reason.sqlite_errorcode = code
    with pytest.raises(meaning) as caught, store.database.session():
        raise OperationalError("UPDATE jobs", {}, reason)
    if isinstance(caught.value, OSError):
        assert caught.value.errno == errno.ENOSPC
