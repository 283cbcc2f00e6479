"""The database behind the store: opened, checked, brought to the version of these tables.

    database = Database("sqlite:////var/lib/joulepath/joulepath.db")
    with database.session() as session: ...      # commits at its end, rolls back on an error

Nothing here is for SQLite alone but the three settings of a connection.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, insert, inspect, select, update
from sqlalchemy.exc import ArgumentError, SQLAlchemyError
from sqlalchemy.orm import Session, sessionmaker

from planner.errors import InputError
from service.store.tables import SCHEMA, Base, SchemaRow

FIELD = "JOULEPATH_DATABASE_URL"
_ACCEPTED = "an address such as sqlite:////path/joulepath.db or postgresql+psycopg://host/name"

MIGRATIONS: Mapping[int, Callable[[Connection], None]] = {}
"""Version of the tables -> what makes the next version of them."""


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
            # The address may hold a password: it is not repeated.
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

    @contextmanager
    def session(self) -> Iterator[Session]:
        """A session whose work is kept as a whole or not at all."""
        with self._sessions.begin() as session:
            yield session

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()


def _settle_sqlite(connection: Any, _: Any) -> None:
    if isinstance(connection, sqlite3.Connection):
        # Readers do not wait for a writer, and two writers wait for each other.
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA busy_timeout=10000")
        connection.execute("PRAGMA foreign_keys=ON")


def _bring_up_to_date(engine: Engine) -> None:
    with engine.begin() as connection:
        if not inspect(connection).has_table(SchemaRow.__tablename__):
            Base.metadata.create_all(connection)
            connection.execute(insert(SchemaRow).values(id=1, version=SCHEMA))
            return
        version = connection.execute(select(SchemaRow.version)).scalar_one()
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
