"""Logs in the database."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import delete
from sqlalchemy.orm import Session

from service.store.database import Database
from service.store.tables import LogRow


def log_id(sha256: str, mapping: bytes | None) -> str:
    """Id of a log: equal for equal bytes with the same mapping."""
    text = sha256 if mapping is None else f"{sha256} {hashlib.sha256(mapping).hexdigest()}"
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Logs:
    """Finds, adds and removes logs.

    Attributes:
        database: where they are.
    """

    database: Database

    def all(self) -> list[dict[str, Any]]:
        """All logs without their findings, newest first."""
        return self.database.newest(LogRow.uploaded_at, lambda row: row.values("found"))

    def get(self, log: str) -> dict[str, Any] | None:
        """One log with its findings, or None."""
        return self.database.look_up(LogRow, log, _with_findings)

    def add(
        self, session: Session, upload: Mapping[str, Any], read: Mapping[str, Any], at: str
    ) -> dict[str, Any]:
        """Add a log inside a session; a stored one is unchanged.

        Args:
            session: in which the row is added.
            upload: ``log`` (its id), ``name``, ``sha256``, ``mapped``, ``bytes``.
            read: ``rows``, ``runs`` and other findings.
            at: the time.
        """
        counts = ("rows", "runs")
        row = session.get(LogRow, upload["log"])
        if row is None:
            row = LogRow(
                id=upload["log"],
                **{key: upload[key] for key in ("name", "sha256", "mapped", "bytes")},
                **{key: read[key] for key in counts},
                found={key: value for key, value in read.items() if key not in counts},
                uploaded_at=at,
            )
            session.add(row)
        return _with_findings(row)

    def remove(self, log: str) -> bool:
        """Remove a log's row; False when there is none."""
        with self.database.session() as session:
            removed = delete(LogRow).where(LogRow.id == log).returning(LogRow.id)
            return session.scalar(removed) is not None


def _with_findings(row: LogRow) -> dict[str, Any]:
    return {**row.values("found"), **row.found}
