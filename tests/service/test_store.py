"""What the service keeps: it survives a restart, and rows say the truth about jobs."""

from __future__ import annotations

import errno
import json
import os
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import create_engine, update
from sqlalchemy.dialects import postgresql
from sqlalchemy.exc import IntegrityError, OperationalError
from sqlalchemy.schema import CreateTable

from planner.errors import InputError
from service.problems import DatabaseLocked
from service.settings import Settings
from service.store import database as databases
from service.store import jobs as job_rows
from service.store.database import MIGRATIONS, Database
from service.store.files import safe_name
from service.store.jobs import may_live, new_owner
from service.store.logs import log_id
from service.store.store import Store
from service.store.tables import Base, LogRow, SchemaRow
from tests.service.conftest import locked
from tests.service.telemetry_documents import entry, model_document

PROBLEM = {"type": "urn:joulepath:problem:worker-lost", "title": "x", "status": 500, "detail": "y"}


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """A store in a folder of its own."""
    return Settings(store_dir=tmp_path / "store")


@pytest.fixture
def store(settings: Settings) -> Iterator[Store]:
    """That store, opened."""
    opened = Store.open(settings)
    yield opened
    opened.close()


def restarted(store: Store, settings: Settings) -> Store:
    """The store as the next service finds it."""
    store.close()
    return Store.open(settings)


def log_row(**changes: Any) -> LogRow:
    values = {
        "id": log_id("ab" * 32, None),
        "name": "drive.csv",
        "sha256": "ab" * 32,
        "mapped": False,
        "bytes": 10,
        "rows": 4,
        "runs": 1,
        "found": {"report": [], "derived": [], "assumed": []},
        "uploaded_at": job_rows.now(),
    }
    return LogRow(**{**values, **changes})


def done(_: Any) -> dict[str, Any]:
    return {"rmse_w": 2.0}


def test_everything_survives_a_restart(store: Store, settings: Settings) -> None:
    with store.database.session() as session:
        store.logs.add(session, log_row())
    text = json.dumps(model_document(), indent=2) + "\n"
    model = store.models.save(text, None, job_rows.now())
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


def test_a_job_of_a_service_that_died_is_failed_with_a_sentence(store: Store) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True
    )
    gone = job_rows.Jobs(
        store.database, new_owner().replace(str(os.getpid()), ended.stdout.strip())
    )
    job = gone.create("diagnose", {})
    assert gone.begin(job["id"], until=1e12)
    assert store.jobs.give_up_dead(PROBLEM, at=0.0) == [job["id"]]
    kept = store.jobs.get(job["id"])
    assert kept is not None
    assert (kept["state"], kept["error"]) == ("failed", PROBLEM)
    assert "the service ended" in kept["progress"]["sentence"]
    # The service that was given up finds out, whatever it does next.
    assert not gone.renew(job["id"], 0.5, "half", until=1e12)
    assert gone.finish(job["id"], done) is None


def test_a_job_of_another_living_service_is_left_alone_while_its_lease_lasts(store: Store) -> None:
    other = job_rows.Jobs(store.database, "elsewhere/77/abcd")
    job = other.create("compare", {})
    other.begin(job["id"], until=100.0)
    assert store.jobs.give_up_dead(PROBLEM, at=99.0) == []
    assert other.renew(job["id"], 0.1, "begun", until=115.0)
    assert store.jobs.give_up_dead(PROBLEM, at=114.0) == []
    assert store.jobs.give_up_dead(PROBLEM, at=116.0) == [job["id"]]


def test_whether_an_owner_may_live() -> None:
    me = new_owner()
    assert may_live("elsewhere/1/abc")
    assert may_live(me.replace(f"/{os.getpid()}/", f"/{os.getppid()}/"))
    # A process of my number that is not me ended before I began.
    assert not may_live(me)
    assert may_live(None)


def test_a_queued_job_is_taken_once(store: Store) -> None:
    other = job_rows.Jobs(store.database, "elsewhere/77/abcd")
    job = store.jobs.create("compare", {})
    assert store.jobs.queued() == [job["id"]]
    assert other.begin(job["id"], until=1e12)
    assert not store.jobs.begin(job["id"], until=1e12)
    assert store.jobs.queued() == []
    assert not store.jobs.fail(job["id"], PROBLEM)


def test_a_cancelled_job_stays_cancelled(store: Store) -> None:
    job = store.jobs.create("compare", {})
    store.jobs.begin(job["id"], until=1e12)
    assert store.jobs.cancel(job["id"])
    assert not store.jobs.renew(job["id"], 0.5, "half", until=1e12)
    assert store.jobs.finish(job["id"], done) is None
    assert not store.jobs.fail(job["id"], PROBLEM)
    assert not store.jobs.cancel(job["id"])
    kept = store.jobs.get(job["id"])
    assert kept is not None
    assert (kept["state"], kept["result"]) == ("cancelled", None)


def test_a_result_and_what_came_of_it_are_kept_together_or_not_at_all(store: Store) -> None:
    job = store.jobs.create("adopt", {})
    store.jobs.begin(job["id"], until=1e12)

    def broken(session: Any) -> dict[str, Any]:
        store.models.add(session, json.dumps(model_document()), None, job_rows.now())
        return {"rmse_w": float("nan")}

    with pytest.raises(ValueError, match="JSON"):
        store.jobs.finish(job["id"], broken)
    assert store.models.all() == []
    kept = store.jobs.get(job["id"])
    assert kept is not None
    assert kept["state"] == "running"


def test_old_finished_jobs_are_forgotten(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job_rows, "KEPT", 3)
    made = [store.jobs.create("compare", {"number": k})["id"] for k in range(6)]
    for job in made[:5]:
        store.jobs.cancel(job)
    store.jobs.create("compare", {})
    left = {job["id"] for job in store.jobs.newest(100)}
    assert left & set(made) == {made[2], made[3], made[4], made[5]}


def test_history_knows_the_versions_that_are_here(store: Store) -> None:
    first = store.models.save(json.dumps(model_document(2)), None, job_rows.now())
    second = store.models.save(json.dumps(model_document(3)), first["id"], job_rows.now())
    entries = store.models.history(second["id"])
    assert entries is not None
    assert [(e["version"], e["id"]) for e in entries] == [(2, first["id"]), (3, second["id"])]
    assert "snapshot" not in entries[0]
    assert store.models.history("nothing") is None
    # A version whose forebears were adopted elsewhere.
    alone = store.models.save(json.dumps(model_document(3)), None, job_rows.now())
    entries = store.models.history(alone["id"])
    assert entries is not None
    assert [e["id"] for e in entries] == [None, alone["id"]]


def test_lists_of_models_say_what_a_version_is_worth(store: Store) -> None:
    saved = model_document(2, history=[entry(2)])
    store.models.save(json.dumps(saved), None, job_rows.now())
    (listed,) = store.models.all()
    assert (listed["version"], listed["adopted"]) == (2, ["air_drag"])
    assert (listed["heldout_rmse_w"], listed["noise_floor_w"]) == (0.52, 0.5)
    assert listed["effects"] == ["electronics"]


def test_the_same_bytes_have_the_same_id_and_another_mapping_another() -> None:
    assert log_id("ab", None) == log_id("ab", None)
    assert len({log_id("ab", None), log_id("ac", None), log_id("ab", b""), log_id("ab", b"x")}) == 4


def test_a_log_is_added_once(store: Store) -> None:
    for name in ("drive.csv", "copy.csv"):
        with store.database.session() as session:
            store.logs.add(session, log_row(name=name))
    assert [log["name"] for log in store.logs.all()] == ["drive.csv"]
    assert store.logs.remove(log_id("ab" * 32, None))
    assert not store.logs.remove(log_id("ab" * 32, None))
    assert store.logs.get(log_id("ab" * 32, None)) is None


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("drive.csv", "drive.csv"),
        ("../../etc/passwd", "passwd"),
        ("C:\\logs\\ride 1.csv.gz", "ride 1.csv.gz"),
        ("..", "log"),
        (".hidden", "hidden"),
        ("a\x00b\n.csv", "a_b_.csv"),
        ("mapping.toml", "log-mapping.toml"),
        ("x" * 300 + ".parquet", "x" * 112 + ".parquet"),
        # Three bytes a character, four, and one that is cut in the middle.
        ("走" * 200 + ".parquet", "走" * 37 + ".parquet"),
        ("𝒙" * 200 + ".csv", "𝒙" * 29 + ".csv"),
        ("a" + "é" * 200, "a" + "é" * 59),
        ("a." + "走" * 200, "a." + "走" * 39),
        ("", "log"),
    ],
)
def test_names_from_outside_become_plain_names(given: str, kept: str) -> None:
    assert safe_name(given) == kept


def test_a_database_of_a_newer_version_is_refused(store: Store, settings: Settings) -> None:
    with store.database.session() as session:
        session.execute(update(SchemaRow).values(version=99))
    with pytest.raises(InputError, match="newer version"):
        Store.open(settings)


def test_an_older_database_is_brought_up_to_date(
    store: Store, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[int] = []
    monkeypatch.setitem(MIGRATIONS, 0, lambda connection: done.append(0))  # type: ignore[arg-type]
    with store.database.session() as session:
        session.execute(update(SchemaRow).values(version=0))
    Store.open(settings).close()
    Store.open(settings).close()
    assert done == [0]


@pytest.mark.parametrize(
    "url", ["nonsense", "nosuchdatabase://host/x", "sqlite:////nonexistent/folder/x.db"]
)
def test_an_address_that_cannot_be_used_is_one_sentence(url: str) -> None:
    with pytest.raises(InputError) as caught:
        Database(url)
    assert caught.value.field == "JOULEPATH_DATABASE_URL"
    assert "\n" not in str(caught.value)


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="JOULEPATH_STORE_DIR"):
        Store.open(Settings(store_dir=tmp_path / "file"))


def test_the_tables_are_not_for_one_database_alone() -> None:
    for table in Base.metadata.sorted_tables:
        assert "CREATE TABLE" in str(CreateTable(table).compile(dialect=postgresql.dialect()))


FIRST_STARTS = """
import os, sys
from pathlib import Path
from service.settings import Settings
from service.store.store import Store

def start(folder, gate):
    os.read(gate, 1)
    store = Store.open(Settings(store_dir=folder))
    store.jobs.create("compare", {})
    store.close()

def together(folder, services):
    gate, opened = os.pipe()
    started = []
    for _ in range(services):
        started.append(os.fork())
        if started[-1] == 0:
            os.close(opened)
            status = 1
            try:
                start(folder, gate)
                status = 0
            except Exception as error:
                print(error, file=sys.stderr)
            finally:
                os._exit(status)
    os.close(opened)
    return sum(os.waitpid(service, 0)[1] == 0 for service in started)

print(*(together(Path(sys.argv[1]) / str(round), 4) for round in range(5)))
"""


def test_first_starts_side_by_side_on_an_empty_database(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FIRST_STARTS, str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.stdout.split(), done.stderr) == (["4"] * 5, "")
    for number in range(5):
        store = Store.open(Settings(store_dir=tmp_path / str(number)))
        assert len(store.jobs.queued()) == 4
        store.close()


def test_tables_that_another_service_makes_meanwhile_are_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on PostgreSQL, where the second to make a table is refused once the first is done."""
    make = Base.metadata.create_all
    url = f"sqlite:///{tmp_path / 'shared.db'}"

    def late(connection: Any) -> None:
        monkeypatch.setattr(Base.metadata, "create_all", make)
        connection.rollback()
        Database(url).close()
        raise IntegrityError("CREATE TABLE", {}, Exception("duplicate key"))

    monkeypatch.setattr(Base.metadata, "create_all", late)
    database = Database(url)
    with database.session() as session:
        assert session.get(SchemaRow, 1) is not None
    database.close()


def test_tables_that_were_made_by_half_are_completed(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'half.db'}"
    engine = create_engine(url)
    SchemaRow.__table__.create(engine)  # type: ignore[attr-defined]
    engine.dispose()
    database = Database(url)
    with database.session() as session:
        session.add(log_row())
    database.close()


def test_a_locked_database_is_read_and_not_changed(
    settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(databases, "PATIENCE_S", 0)
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
            again.jobs.give_up_dead(PROBLEM, at=0.0)
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
