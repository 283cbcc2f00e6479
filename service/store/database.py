"""The database behind the store: opened, checked, brought to the version of these tables.

    database = Database("sqlite:////var/lib/joulepath/joulepath.db")
    with database.session() as session: ...      # commits at its end, rolls back on an error

Only three things are specific to SQLite: the settings of a connection, the creation of tables by
one service at a time, and the meaning of failures.
"""

from __future__ import annotations

import errno
import os
import sqlite3
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple, Self, TypeVar

from sqlalchemy import Connection, Engine, create_engine, event, insert, inspect, select, update
from sqlalchemy.exc import (
    ArgumentError,
    IntegrityError,
    OperationalError,
    ProgrammingError,
    SQLAlchemyError,
)
from sqlalchemy.exc import TimeoutError as NoConnection
from sqlalchemy.orm import InstrumentedAttribute, Session, sessionmaker

from planner.errors import InputError
from service.problems import DatabaseLocked
from service.store.tables import SCHEMA, Base, SchemaRow

Row = TypeVar("Row", bound=Base)
T = TypeVar("T")

FIELD = "JOULEPATH_DATABASE_URL"
_ACCEPTED = "an address such as sqlite:////path/joulepath.db or postgresql+psycopg://host/name"

LOCK_PATIENCE_S = 5
"""Seconds that a change waits for a locked SQLite file; Python's own default."""

RETRY_S = 0.01
"""Seconds between attempts that SQLite itself does not repeat."""

MIGRATIONS: Mapping[int, Callable[[Connection], None]] = {}
"""Version of the tables -> function that migrates them to the next version."""


class Database:
    """Sessions on one database.

    Args:
        url: address as SQLAlchemy reads it.

    Raises:
        InputError: the address cannot be used, or the database is of a newer joulepath.
    """

    def __init__(self, url: str) -> None:
        try:
            self._engine = create_engine(url, pool_pre_ping=True)
        except (ArgumentError, ModuleNotFoundError) as error:
            # The address may contain a password, so it is not repeated.
            raise InputError(FIELD, f"cannot be used: {error}", accepted=_ACCEPTED) from None
        if self._engine.dialect.name == "sqlite":
            event.listen(self._engine, "connect", _settle_sqlite)
        self._sessions = sessionmaker(self._engine, expire_on_commit=False)
        try:
            _bring_up_to_date(self._engine)
        except SQLAlchemyError as error:
            self.close()
            reason = getattr(error, "orig", None) or type(error).__name__
            raise InputError(FIELD, f"cannot be opened: {reason}", accepted=_ACCEPTED) from None
        except InputError:
            self.close()
            raise
        self._file = _Identity.of(self._engine)

    def problem(self) -> str | None:
        """Why the database cannot be used any more, or None."""
        if _Identity.of(self._engine) != self._file:
            # The open file would still take changes, which end with this process.
            return "the database's file was removed or replaced; start the service again"
        try:
            with self.session() as session:
                there = _version(session.connection(), lock=False) == SCHEMA
        except (SQLAlchemyError, DatabaseLocked, OSError) as error:
            return f"the database cannot be read: {type(error).__name__}"
        return None if there else "the database's tables are not those of this service"

    @contextmanager
    def session(self) -> Iterator[Session]:
        """A session that is committed as a whole or rolled back.

        Raises:
            DatabaseLocked: the database is not available at the moment.
            OSError: its disk is full.
        """
        try:
            with self._sessions.begin() as session:
                yield session
        except (OperationalError, NoConnection) as error:
            raise _meaning(error) from error

    def look_up(self, table: type[Row], identity: str, shown: Callable[[Row], T]) -> T | None:
        """One row as ``shown`` gives it, or None."""
        with self.session() as session:
            row = session.get(table, identity)
            return None if row is None else shown(row)

    def newest(
        self, time: InstrumentedAttribute[str], shown: Callable[[Any], T], most: int | None = None
    ) -> list[T]:
        """Rows as ``shown`` gives them, newest first by a column of their table."""
        table = time.class_
        with self.session() as session:
            rows = select(table).order_by(time.desc(), table.id).limit(most)
            return [shown(row) for row in session.scalars(rows)]

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()


class _Identity(NamedTuple):
    """Which file an SQLite database is."""

    device: int
    number: int

    @classmethod
    def of(cls, engine: Engine) -> Self | None:
        """None where there is no file: another kind of database, one in memory, or removed."""
        path = engine.url.database
        if engine.dialect.name != "sqlite" or not path:
            return None
        try:
            found = os.stat(path)
        except OSError:
            return None
        return cls(found.st_dev, found.st_ino)


def _meaning(error: SQLAlchemyError) -> Exception:
    """The error for the caller of a failure that the service did not cause."""
    reason = getattr(error, "orig", None)
    if isinstance(reason, sqlite3.Error):
        # Of an extended code, such as SQLITE_BUSY_SNAPSHOT, the last byte is the plain one.
        code = reason.sqlite_errorcode & 0xFF
        if code == sqlite3.SQLITE_FULL:
            return OSError(errno.ENOSPC, "the database's disk is full")
        if code not in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
            return error
    return DatabaseLocked()


def _settle_sqlite(connection: Any, _: Any) -> None:
    if isinstance(connection, sqlite3.Connection):
        # Two writers wait for each other, from the first statement on.
        connection.execute(f"PRAGMA busy_timeout={1000 * LOCK_PATIENCE_S}")
        _let_readers_pass(connection)
        connection.execute("PRAGMA foreign_keys=ON")


def _let_readers_pass(connection: sqlite3.Connection) -> None:
    """Readers do not wait for a writer.

    Where services open a new file together, SQLite refuses all but one without any patience: a
    reader that waits to be the only one would wait for others that do the same.
    """
    until = time.monotonic() + LOCK_PATIENCE_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or time.monotonic() > until:
                raise
        time.sleep(RETRY_S)


def _bring_up_to_date(engine: Engine) -> None:
    """Create or migrate the tables, while other services may do the same."""
    with engine.connect() as connection:
        if _version(connection) == SCHEMA:
            return
    try:
        _make_or_migrate(engine)
    except (IntegrityError, ProgrammingError):
        # Another service created them since the check; SQLite waits, other databases fail.
        _make_or_migrate(engine)


def _version(connection: Connection, *, lock: bool = True) -> int | None:
    """Version of the tables, None if they do not exist.

    Args:
        connection: of the database.
        lock: whether to lock its row in the transaction.
    """
    if not inspect(connection).has_table(SchemaRow.__tablename__):
        return None
    query = select(SchemaRow.version)
    return connection.execute(query.with_for_update() if lock else query).scalar_one_or_none()


def _make_or_migrate(engine: Engine) -> None:
    with engine.begin() as connection:
        if engine.dialect.name == "sqlite":
            # Its driver begins no transaction for a query or a new table.
            connection.exec_driver_sql("BEGIN IMMEDIATE")
        version = _version(connection)
        if version is None:
            Base.metadata.create_all(connection)
            connection.execute(insert(SchemaRow).values(id=1, version=SCHEMA))
            return
        if version > SCHEMA:
            raise InputError(
                FIELD,
                "belongs to a newer version of joulepath",
                value=version,
                accepted=f"a database whose tables are of version {SCHEMA} or older",
            )
        for step in range(version, SCHEMA):
            MIGRATIONS[step](connection)
            connection.execute(update(SchemaRow).values(version=step + 1))
