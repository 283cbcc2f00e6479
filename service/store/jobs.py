"""Jobs in the database: the row is the truth, whoever runs it.

A service that runs a job owns its row and renews a lease on it. Every change of a running job asks
for the owner, so that a job that was cancelled, or given up for dead by another service, is found
out at the next renewal.

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
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import CursorResult, delete, false, func, select, update
from sqlalchemy.orm import Session

from service import problems
from service.store.database import Database
from service.store.tables import JobRow

LEASE_S = 15.0
"""Seconds after which a running job whose lease was not renewed is given up for dead."""
KEPT = 1_000
"""Finished jobs that are kept; older ones are forgotten."""

UNFINISHED = ("queued", "running")

DIED = "the service ended while this job ran; start it again"


def now() -> str:
    """This moment, as all tables have it."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


def new_owner() -> str:
    """A name for this service: host, process, and what tells it from an earlier one."""
    return f"{socket.gethostname()[:200]}/{os.getpid()}/{secrets.token_hex(4)}"


class Jobs:
    """Finds jobs and moves them from state to state.

    Args:
        database: where they are.
        owner: name of the service that asks, see ``new_owner``.
    """

    def __init__(self, database: Database, owner: str) -> None:
        self._database = database
        self.owner = owner

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
        with self._database.session() as session:
            session.add(row)
            self._forget_old(session)
            return document(row)

    def get(self, job: str) -> dict[str, Any] | None:
        """A job with its result or error, or None."""
        with self._database.session() as session:
            row = session.get(JobRow, job)
            return None if row is None else document(row)

    def newest(self, most: int) -> list[dict[str, Any]]:
        """The newest jobs, newest first, without their results."""
        with self._database.session() as session:
            rows = select(JobRow).order_by(JobRow.created_at.desc(), JobRow.id).limit(most)
            return [document(row, result=False) for row in session.scalars(rows)]

    def queued(self) -> list[str]:
        """Jobs that wait, oldest first."""
        with self._database.session() as session:
            waiting = select(JobRow.id).where(JobRow.state == "queued").order_by(JobRow.created_at)
            return list(session.scalars(waiting))

    def uses_log(self, log: str) -> bool:
        """Whether an unfinished job reads a log."""
        with self._database.session() as session:
            rows = session.scalars(select(JobRow).where(JobRow.state.in_(UNFINISHED)))
            return any(row.request.get("log") == log for row in rows)

    def reading(self, log: str) -> dict[str, Any] | None:
        """The unfinished job that reads a log for the first time, or None."""
        with self._database.session() as session:
            rows = session.scalars(
                select(JobRow).where(JobRow.kind == "check", JobRow.state.in_(UNFINISHED))
            )
            return next((document(row) for row in rows if row.request["log"] == log), None)

    def begin(self, job: str, until: float) -> bool:
        """Take a queued job; False when it is not to be had any more."""
        return self._move(
            job,
            ("queued",),
            None,
            state="running",
            owner=self.owner,
            lease_until=until,
            started_at=now(),
            sentence="starting",
        )

    def renew(self, job: str, share: float, sentence: str, until: float) -> bool:
        """Say how far a job is; False when it is not ours any more."""
        return self._move(
            job, ("running",), self.owner, share=share, sentence=sentence, lease_until=until
        )

    def finish(
        self, job: str, complete: Callable[[Session], dict[str, Any]]
    ) -> dict[str, Any] | None:
        """Keep a job's result and what came of it, all of it or nothing.

        Args:
            job: which.
            complete: adds rows to the session and returns the result.

        Returns:
            the result; None when the job is not ours any more.
        """
        with self._database.session() as session:
            if not _moved(
                session,
                job,
                ("running",),
                self.owner,
                state="done",
                share=1.0,
                sentence="done",
                finished_at=now(),
                lease_until=None,
            ):
                return None
            result = complete(session)
            text = json.dumps(result, allow_nan=False, ensure_ascii=False)
            session.execute(update(JobRow).where(JobRow.id == job).values(result=text))
            return result

    def fail(self, job: str, problem: dict[str, Any]) -> bool:
        """Mark our running job as failed, with a problem document that says why."""
        return self._move(
            job,
            ("running",),
            self.owner,
            state="failed",
            error=problem,
            sentence=str(problem.get("detail", "")),
            finished_at=now(),
            lease_until=None,
        )

    def cancel(self, job: str) -> bool:
        """Mark an unfinished job as cancelled, whoever runs it; False when it was finished."""
        return self._move(
            job,
            UNFINISHED,
            None,
            state="cancelled",
            sentence="cancelled",
            finished_at=now(),
            lease_until=None,
        )

    def give_up_dead(self, at: float) -> list[str]:
        """Mark running jobs as failed whose service is gone.

        Args:
            at: s since 1970; leases that ended before are over, whoever lives.

        Returns:
            the jobs concerned.
        """
        dead = []
        with self._database.session() as session:
            # Changes nothing and waits as a change does: who holds the database is found out, and
            # what is read next is not from before.
            session.execute(update(JobRow).where(false()).values(sentence=DIED))
            rows = session.execute(
                select(JobRow.id, JobRow.owner, JobRow.lease_until).where(
                    JobRow.state == "running", JobRow.owner != self.owner
                )
            ).all()
            for job, owner, until in rows:
                if (until is None or until < at or not may_live(owner)) and _moved(
                    session,
                    job,
                    ("running",),
                    owner,
                    state="failed",
                    error=problems.document(500, "worker-lost", DIED),
                    sentence=DIED,
                    finished_at=now(),
                    lease_until=None,
                ):
                    dead.append(job)
        return dead

    def _move(self, job: str, states: tuple[str, ...], whose: str | None, **values: Any) -> bool:
        with self._database.session() as session:
            return _moved(session, job, states, whose, **values)

    def _forget_old(self, session: Session) -> None:
        finished = JobRow.state.not_in(UNFINISHED)
        count = session.scalar(select(func.count()).select_from(JobRow).where(finished)) or 0
        if count > KEPT:
            oldest = (
                select(JobRow.id).where(finished).order_by(JobRow.created_at).limit(count - KEPT)
            )
            session.execute(delete(JobRow).where(JobRow.id.in_(list(session.scalars(oldest)))))


def _moved(
    session: Session, job: str, states: tuple[str, ...], whose: str | None, **values: Any
) -> bool:
    """Change a row if it is in one of the states and, where an owner is given, that one's."""
    wanted = update(JobRow).where(JobRow.id == job, JobRow.state.in_(states)).values(**values)
    if whose is not None:
        wanted = wanted.where(JobRow.owner == whose)
    changed = session.execute(wanted.execution_options(synchronize_session=False))
    return isinstance(changed, CursorResult) and changed.rowcount == 1


def may_live(owner: str | None) -> bool:
    """False when the owner ran on this host and its process is gone."""
    host, _, rest = (owner or "").rpartition("/")[0].partition("/")
    if host != socket.gethostname()[:200] or not rest.isdigit():
        return True
    if int(rest) == os.getpid():
        # The same number and another name: an earlier process, as in a restarted container.
        return False
    try:
        os.kill(int(rest), 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def document(row: JobRow, *, result: bool = True) -> dict[str, Any]:
    """A job as the service answers it."""
    plain = {
        "id": row.id,
        "kind": row.kind,
        "state": row.state,
        "progress": {"share": row.share, "sentence": row.sentence},
        "request": row.request,
        "error": row.error,
        "created_at": row.created_at,
        "started_at": row.started_at,
        "finished_at": row.finished_at,
    }
    if result:
        plain["result"] = None if row.result is None else json.loads(row.result)
    return plain
