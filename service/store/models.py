"""Versions of models in the database."""

from __future__ import annotations

import json
import secrets
from collections.abc import Mapping
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from planner.amounts import watts
from service.store.database import Database
from service.store.tables import ModelRow


class Models:
    """Finds and adds versions of models; none is ever changed.

    Args:
        database: where they are.
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[dict[str, Any]]:
        """All versions, newest first."""
        with self._database.session() as session:
            newest = select(ModelRow).order_by(ModelRow.created_at.desc(), ModelRow.id)
            return [summary(row) for row in session.scalars(newest)]

    def get(self, model: str) -> dict[str, Any] | None:
        """What the list says of one version, or None."""
        with self._database.session() as session:
            row = session.get(ModelRow, model)
            return None if row is None else summary(row)

    def document(self, model: str) -> str | None:
        """The saved model letter by letter, or None."""
        with self._database.session() as session:
            row = session.get(ModelRow, model)
            return None if row is None else row.document

    def history(self, model: str) -> list[dict[str, Any]] | None:
        """The saved model's history; each entry with the ``id`` of its version, if it is here."""
        with self._database.session() as session:
            row = session.get(ModelRow, model)
            if row is None:
                return None
            entries = json.loads(row.document).get("history") or []
            known: dict[Any, str] = {}
            above: ModelRow | None = row
            while above is not None:
                known.setdefault(above.version, above.id)
                above = session.get(ModelRow, above.parent_id) if above.parent_id else None
            # Snapshots are what a version is brought back from, and nothing to read.
            shown = [{k: v for k, v in entry.items() if k != "snapshot"} for entry in entries]
            return [{**entry, "id": known.get(entry.get("version"))} for entry in shown]

    def add(self, session: Session, document: str, parent: str | None, at: str) -> dict[str, Any]:
        """Add a version inside a session."""
        row = model_row(json.loads(document), document, parent, at)
        session.add(row)
        return summary(row)

    def save(self, document: str, parent: str | None, at: str) -> dict[str, Any]:
        """Add a version."""
        with self._database.session() as session:
            return self.add(session, document, parent, at)


def model_row(saved: Mapping[str, Any], document: str, parent: str | None, at: str) -> ModelRow:
    """A row for a saved model.

    Args:
        saved: the document, parsed.
        document: the document's text.
        parent: id of the version it was made from.
        at: when.
    """
    return ModelRow(
        id=secrets.token_hex(8),
        name=str(saved["name"])[:255],
        version=int(saved["version"]),
        parent_id=parent,
        vehicle=str(saved["vehicle"].get("name") or saved["name"])[:255],
        effects=list(saved["effects"]),
        document=document,
        created_at=at,
    )


def summary(row: ModelRow) -> dict[str, Any]:
    """What lists say of a version."""
    last = (json.loads(row.document).get("history") or [{}])[-1]
    adopted = list(last.get("adopted") or ())
    error = (last.get("after") or {}).get("heldout_rmse_w")
    said = ", ".join([f"version {row.version}", *adopted])
    return {
        "id": row.id,
        "name": row.name,
        "title": said if error is None else f"{said}: {watts(error)}",
        "version": row.version,
        "parent_id": row.parent_id,
        "vehicle": row.vehicle,
        "effects": row.effects,
        "adopted": adopted,
        "heldout_rmse_w": error,
        "noise_floor_w": last.get("noise_floor_w"),
        "created_at": row.created_at,
    }
