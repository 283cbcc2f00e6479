"""Versions of models in the database."""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from planner.amounts import watts
from service.store.database import Database
from service.store.tables import ModelRow


@dataclass(frozen=True)
class Models:
    """Finds and adds versions of models; none is ever changed.

    Attributes:
        database: where they are.
    """

    database: Database

    def all(self) -> list[dict[str, Any]]:
        """All versions, newest first."""
        return self.database.newest(ModelRow.created_at, summary)

    def get(self, model: str) -> dict[str, Any] | None:
        """The summary of one version, or None."""
        return self.database.look_up(ModelRow, model, summary)

    def document(self, model: str) -> str | None:
        """The saved model byte for byte, or None."""
        return self.database.look_up(ModelRow, model, lambda row: row.document)

    def history(self, model: str) -> list[dict[str, Any]] | None:
        """A saved model's history; each entry with the ``id`` of its version, if stored here."""
        with self.database.session() as session:
            row = session.get(ModelRow, model)
            if row is None:
                return None
            entries = json.loads(row.document).get("history") or []
            known: dict[Any, str] = {}
            above: ModelRow | None = row
            while above is not None:
                known.setdefault(above.version, above.id)
                above = session.get(ModelRow, above.parent_id) if above.parent_id else None
            # Snapshots serve to restore a version and are not shown.
            shown = [{k: v for k, v in entry.items() if k != "snapshot"} for entry in entries]
            return [{**entry, "id": known.get(entry.get("version"))} for entry in shown]

    def add(self, session: Session, document: str, parent: str | None, at: str) -> dict[str, Any]:
        """Add a version inside a session."""
        saved = json.loads(document)
        row = ModelRow(
            id=secrets.token_hex(8),
            name=str(saved["name"])[:255],
            version=int(saved["version"]),
            parent_id=parent,
            vehicle=str(saved["vehicle"].get("name") or saved["name"])[:255],
            effects=list(saved["effects"]),
            document=document,
            created_at=at,
        )
        session.add(row)
        return summary(row)

    def save(self, document: str, parent: str | None, at: str) -> dict[str, Any]:
        """Add a version."""
        with self.database.session() as session:
            return self.add(session, document, parent, at)


def summary(row: ModelRow) -> dict[str, Any]:
    """A version as lists show it."""
    last = (json.loads(row.document).get("history") or [{}])[-1]
    adopted, error = (
        list(last.get("adopted") or ()),
        (last.get("after") or {}).get("heldout_rmse_w"),
    )
    said = ", ".join([f"version {row.version}", *adopted])
    return {
        **row.values("document"),
        "title": said if error is None else f"{said}: {watts(error)}",
        "adopted": adopted,
        "heldout_rmse_w": error,
        "noise_floor_w": last.get("noise_floor_w"),
    }
