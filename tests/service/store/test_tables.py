"""The tables are made once, for any database, and brought up to date."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import create_engine, update
from sqlalchemy.dialects import postgresql
from sqlalchemy.exc import IntegrityError
from sqlalchemy.schema import CreateTable

from planner.errors import InputError
from service.settings import Settings
from service.store import Store, now
from service.store.database import MIGRATIONS, Database
from service.store.logs import Logs
from service.store.tables import Base, SchemaRow
from tests.service.store.rows import READ, UPLOAD


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


def test_the_tables_are_not_for_one_database_alone() -> None:
    for table in Base.metadata.sorted_tables:
        assert "CREATE TABLE" in str(CreateTable(table).compile(dialect=postgresql.dialect()))


FIRST_STARTS = """
import os, sys
from pathlib import Path
from service.settings import Settings
from service.store import Store, log_id, now
from service.store.logs import Logs

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
        Logs(database).add(session, UPLOAD, READ, now())
    database.close()
