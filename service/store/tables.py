"""Tables of the database, in types that every database of SQLAlchemy has.

Times are ISO 8601 text in UTC of one length, so that they sort as text. Documents that must be
returned byte for byte (a saved model, a result) are text, other ones JSON.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import JSON, BigInteger, ForeignKey, Index, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

SCHEMA = 1
"""Version of these tables; a change of them raises it and adds a step to database.MIGRATIONS."""


class Base(DeclarativeBase):
    """Base of all tables."""

    type_annotation_map = {dict[str, Any]: JSON, list[str]: JSON}  # noqa: RUF012

    def values(self, *omitted: str) -> dict[str, Any]:
        """Values by column, without some of them."""
        columns = [column.key for column in self.__table__.columns]
        return {key: getattr(self, key) for key in columns if key not in omitted}


class SchemaRow(Base):
    """One row: which version of the tables this database has."""

    __tablename__ = "joulepath_schema"

    id: Mapped[int] = mapped_column(primary_key=True)
    version: Mapped[int]


class LogRow(Base):
    """An uploaded log."""

    __tablename__ = "logs"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(255))
    sha256: Mapped[str] = mapped_column(String(64), index=True)
    mapped: Mapped[bool]
    bytes: Mapped[int] = mapped_column(BigInteger)
    rows: Mapped[int] = mapped_column(BigInteger)
    runs: Mapped[int]
    found: Mapped[dict[str, Any]]
    uploaded_at: Mapped[str] = mapped_column(String(32), index=True)


class ModelRow(Base):
    """One version of a model; ``parent_id`` is the version that it was made from."""

    __tablename__ = "models"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(255))
    version: Mapped[int]
    parent_id: Mapped[str | None] = mapped_column(String(32), ForeignKey("models.id"))
    vehicle: Mapped[str] = mapped_column(String(255))
    effects: Mapped[list[str]]
    document: Mapped[str] = mapped_column(Text)
    created_at: Mapped[str] = mapped_column(String(32), index=True)


class JobRow(Base):
    """A job. ``owner`` is the service that runs it, until ``lease_until`` (s since 1970)."""

    __tablename__ = "jobs"
    __table_args__ = (Index("jobs_by_state", "state", "created_at"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(16))
    state: Mapped[str] = mapped_column(String(16))
    share: Mapped[float] = mapped_column(default=0.0)
    sentence: Mapped[str] = mapped_column(Text, default="")
    request: Mapped[dict[str, Any]]
    result: Mapped[str | None] = mapped_column(Text)
    error: Mapped[dict[str, Any] | None]
    owner: Mapped[str | None] = mapped_column(String(255))
    lease_until: Mapped[float | None]
    created_at: Mapped[str] = mapped_column(String(32))
    started_at: Mapped[str | None] = mapped_column(String(32))
    finished_at: Mapped[str | None] = mapped_column(String(32))
