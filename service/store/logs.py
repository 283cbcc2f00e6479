"""Logs in the database."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from service.store.database import Database
from service.store.tables import LogRow


def log_id(sha256: str, mapping: bytes | None) -> str:
    """The same for the same bytes read by the same mapping, whenever they come."""
    text = sha256 if mapping is None else f"{sha256} {hashlib.sha256(mapping).hexdigest()}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class Logs:
    """Finds, adds and removes logs.

    Args:
        database: where they are.
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[dict[str, Any]]:
        """All logs, newest first, without what was found in them."""
        with self._database.session() as session:
            newest = select(LogRow).order_by(LogRow.uploaded_at.desc(), LogRow.id)
            return [_summary(row) for row in session.scalars(newest)]

    def get(self, log: str) -> dict[str, Any] | None:
        """One log with what was found in it, or None."""
        with self._database.session() as session:
            row = session.get(LogRow, log)
            return None if row is None else {**_summary(row), **row.found}

    def add(
        self, session: Session, upload: Mapping[str, Any], read: Mapping[str, Any], at: str
    ) -> dict[str, Any]:
        """Add a log inside a session; one that is there already stays as it is.

        Args:
            session: in which the row is added.
            upload: ``log`` (its id), ``name``, ``sha256``, ``mapped``, ``bytes``.
            read: ``rows``, ``runs``, and what else was found in it.
            at: when.
        """
        row = session.get(LogRow, upload["log"])
        if row is None:
            row = LogRow(
                id=upload["log"],
                name=upload["name"],
                sha256=upload["sha256"],
                mapped=upload["mapped"],
                bytes=upload["bytes"],
                rows=read["rows"],
                runs=read["runs"],
                found={k: v for k, v in read.items() if k not in ("rows", "runs")},
                uploaded_at=at,
            )
            session.add(row)
        return {**_summary(row), **row.found}

    def remove(self, log: str) -> bool:
        """Remove a log's row; False when there is none."""
        with self._database.session() as session:
            removed = session.scalars(
                delete(LogRow).where(LogRow.id == log).returning(LogRow.id)
            ).all()
            return bool(removed)


def _summary(row: LogRow) -> dict[str, Any]:
    return {
        "id": row.id,
        "name": row.name,
        "sha256": row.sha256,
        "mapped": row.mapped,
        "bytes": row.bytes,
        "rows": row.rows,
        "runs": row.runs,
        "uploaded_at": row.uploaded_at,
    }
