"""Jobs in the database; their rows hold their only state.

A service that runs a job owns its row and renews a lease on it. Every change of a running job
checks the owner. So a job that was cancelled, or failed by another service, is noticed at the next
renewal.

    queued ──begin──► running ──finish──► done
       │                 ├──────fail────► failed
       └────cancel───────┴──────────────► cancelled
"""

from __future__ import annotations

import json
import os
import secrets
import socket
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from typing import Any

from sqlalchemy import CursorResult, delete, false, select, update
from sqlalchemy.orm import Session

from service import problems
from service.store.database import Database
from service.store.tables import JobRow

LEASE_S = 15.0
"""Seconds after which a running job without a renewed lease is marked as failed."""
KEPT = 1_000
"""Number of finished jobs that are stored; older ones are deleted."""

UNFINISHED = ("queued", "running")

DIED = "the service ended while this job ran; start it again"


def now() -> str:
    """The current time in the format of all tables."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


def new_owner() -> str:
    """A name for this service: host, process, and a random part."""
    return f"{socket.gethostname()[:200]}/{os.getpid()}/{secrets.token_hex(4)}"


@dataclass(frozen=True)
class Jobs:
    """Finds jobs and moves them from state to state.

    Attributes:
        database: where they are.
        owner: name of this service, see ``new_owner``.
    """

    database: Database
    owner: str

    def create(self, kind: str, request: dict[str, Any]) -> dict[str, Any]:
        """A new job, queued."""
        row = JobRow(
            id=secrets.token_hex(8),
            kind=kind,
            state="queued",
            share=0.0,
            sentence="waiting for a worker",
            request=request,
            created_at=now(),
        )
        with self.database.session() as session:
            session.add(row)
            self._forget_old(session)
            return document(row)

    def get(self, job: str) -> dict[str, Any] | None:
        """A job with its result or error, or None."""
        return self.database.look_up(JobRow, job, document)

    def newest(self, most: int) -> list[dict[str, Any]]:
        """The newest jobs without their results, newest first."""
        shown = partial(document, result=False)
        return self.database.newest(JobRow.created_at, shown, most)

    def queued(self) -> list[str]:
        """Ids of queued jobs, oldest first."""
        with self.database.session() as session:
            waiting = select(JobRow.id).where(JobRow.state == "queued").order_by(JobRow.created_at)
            return list(session.scalars(waiting))

    def uses_log(self, log: str) -> bool:
        """Whether an unfinished job reads a log."""
        return bool(self._unfinished(log))

    def reading(self, log: str) -> dict[str, Any] | None:
        """The unfinished job that reads a log for the first time, or None."""
        return next((job for job in self._unfinished(log) if job["kind"] == "check"), None)

    def _unfinished(self, log: str) -> list[dict[str, Any]]:
        with self.database.session() as session:
            rows = session.scalars(select(JobRow).where(JobRow.state.in_(UNFINISHED)))
            return [document(row) for row in rows if row.request.get("log") == log]

    def begin(self, job: str, until: float) -> bool:
        """Take a queued job; False if it is not available any more."""
        begun = {"state": "running", "sentence": "starting", "started_at": now()}
        return self._move(job, ("queued",), None, owner=self.owner, lease_until=until, **begun)

    def renew(self, job: str, share: float, sentence: str, until: float) -> bool:
        """Store the progress of a job; False if it is not ours any more."""
        values = {"share": share, "sentence": sentence, "lease_until": until}
        return self._move(job, ("running",), self.owner, **values)

    def finish(
        self, job: str, complete: Callable[[Session], dict[str, Any]]
    ) -> dict[str, Any] | None:
        """Store a job's result and rows in one transaction.

        Args:
            job: which.
            complete: adds rows to the session and returns the result.

        Returns:
            the result; None when the job is not ours any more.
        """
        with self.database.session() as session:
            done = _ended("done", "done", share=1.0)
            if not _moved(session, job, ("running",), self.owner, **done):
                return None
            result = complete(session)
            text = json.dumps(result, allow_nan=False, ensure_ascii=False)
            session.execute(update(JobRow).where(JobRow.id == job).values(result=text))
            return result

    def fail(self, job: str, problem: dict[str, Any]) -> bool:
        """Mark our running job as failed, with a problem document that says why."""
        failed = _ended("failed", str(problem.get("detail", "")), error=problem)
        return self._move(job, ("running",), self.owner, **failed)

    def cancel(self, job: str) -> bool:
        """Mark an unfinished job of any service as cancelled; False if it was finished."""
        return self._move(job, UNFINISHED, None, **_ended("cancelled", "cancelled"))

    def give_up_dead(self, at: float) -> list[str]:
        """Mark running jobs of services that are gone as failed.

        Args:
            at: s since 1970; leases that ended before this time are over.

        Returns:
            the jobs concerned.
        """
        dead = []
        failed = _ended("failed", DIED, error=problems.document(500, "worker-lost", DIED))
        with self.database.session() as session:
            # Changes nothing but waits for the lock, so that the next query reads current rows.
            session.execute(update(JobRow).where(false()).values(sentence=DIED))
            rows = session.execute(
                select(JobRow.id, JobRow.owner, JobRow.lease_until).where(
                    JobRow.state == "running", JobRow.owner != self.owner
                )
            ).all()
            for job, owner, until in rows:
                gone = until is None or until < at or not may_live(owner)
                if gone and _moved(session, job, ("running",), owner, **failed):
                    dead.append(job)
        return dead

    def _move(self, job: str, states: tuple[str, ...], whose: str | None, **values: Any) -> bool:
        with self.database.session() as session:
            return _moved(session, job, states, whose, **values)

    def _forget_old(self, session: Session) -> None:
        finished = JobRow.state.not_in(UNFINISHED)
        newest = select(JobRow.id).where(finished).order_by(JobRow.created_at.desc())
        old = session.scalars(newest.offset(KEPT)).all()
        session.execute(delete(JobRow).where(JobRow.id.in_(old)))


def _ended(state: str, sentence: str, **values: Any) -> dict[str, Any]:
    """Values of a job that ended in a state."""
    ended = {"state": state, "sentence": sentence, "finished_at": now(), "lease_until": None}
    return {**ended, **values}


def _moved(
    session: Session, job: str, states: tuple[str, ...], whose: str | None, **values: Any
) -> bool:
    """Change a row if its state is one of these and its owner, if given, is this one."""
    wanted = update(JobRow).where(JobRow.id == job, JobRow.state.in_(states)).values(**values)
    if whose is not None:
        wanted = wanted.where(JobRow.owner == whose)
    changed = session.execute(wanted.execution_options(synchronize_session=False))
    return isinstance(changed, CursorResult) and changed.rowcount == 1


def may_live(owner: str | None) -> bool:
    """False if the owner ran on this host and its process is gone."""
    host, _, rest = (owner or "").rpartition("/")[0].partition("/")
    if host != socket.gethostname()[:200] or not rest.isdigit():
        return True
    if int(rest) == os.getpid():
        # Same number, other name: an earlier process, as in a restarted container.
        return False
    try:
        os.kill(int(rest), 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def document(row: JobRow, *, result: bool = True) -> dict[str, Any]:
    """A job as the service returns it."""
    plain = row.values("share", "sentence", "result", "owner", "lease_until")
    plain["progress"] = {"share": row.share, "sentence": row.sentence}
    if result:
        plain["result"] = None if row.result is None else json.loads(row.result)
    return plain
