"""Rows say the truth about jobs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from service.store import Store, now
from service.store import jobs as job_rows
from service.store.jobs import may_live, new_owner
from tests.service.store.rows import PROBLEM, done
from tests.service.telemetry_documents import model_document


def test_a_job_of_a_service_that_died_is_failed_with_a_sentence(store: Store) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True
    )
    gone = job_rows.Jobs(
        store.database, new_owner().replace(str(os.getpid()), ended.stdout.strip())
    )
    job = gone.create("diagnose", {})
    assert gone.begin(job["id"], until=1e12)
    assert store.jobs.give_up_dead(at=0.0) == [job["id"]]
    kept = store.jobs.get(job["id"])
    assert kept is not None
    assert (kept["state"], kept["error"]["type"]) == (
        "failed",
        "urn:joulepath:problem:worker-lost",
    )
    assert "the service ended" in kept["progress"]["sentence"]
    # The service that was given up finds out, whatever it does next.
    assert not gone.renew(job["id"], 0.5, "half", until=1e12)
    assert gone.finish(job["id"], done) is None


def test_a_job_of_another_living_service_is_left_alone_while_its_lease_lasts(store: Store) -> None:
    other = job_rows.Jobs(store.database, "elsewhere/77/abcd")
    job = other.create("compare", {})
    other.begin(job["id"], until=100.0)
    assert store.jobs.give_up_dead(at=99.0) == []
    assert other.renew(job["id"], 0.1, "begun", until=115.0)
    assert store.jobs.give_up_dead(at=114.0) == []
    assert store.jobs.give_up_dead(at=116.0) == [job["id"]]


def test_whether_an_owner_may_live() -> None:
    me = new_owner()
    assert may_live("elsewhere/1/abc")
    assert may_live(me.replace(f"/{os.getpid()}/", f"/{os.getppid()}/"))
    # A process of my number that is not me ended before I began.
    assert not may_live(me)
    assert may_live(None)


def test_a_queued_job_is_taken_once(store: Store) -> None:
    other = job_rows.Jobs(store.database, "elsewhere/77/abcd")
    job = store.jobs.create("compare", {})
    assert store.jobs.queued() == [job["id"]]
    assert other.begin(job["id"], until=1e12)
    assert not store.jobs.begin(job["id"], until=1e12)
    assert store.jobs.queued() == []
    assert not store.jobs.fail(job["id"], PROBLEM)


def test_a_cancelled_job_stays_cancelled(store: Store) -> None:
    job = store.jobs.create("compare", {})
    store.jobs.begin(job["id"], until=1e12)
    assert store.jobs.cancel(job["id"])
    assert not store.jobs.renew(job["id"], 0.5, "half", until=1e12)
    assert store.jobs.finish(job["id"], done) is None
    assert not store.jobs.fail(job["id"], PROBLEM)
    assert not store.jobs.cancel(job["id"])
    kept = store.jobs.get(job["id"])
    assert kept is not None
    assert (kept["state"], kept["result"]) == ("cancelled", None)


def test_a_result_and_what_came_of_it_are_kept_together_or_not_at_all(store: Store) -> None:
    job = store.jobs.create("adopt", {})
    store.jobs.begin(job["id"], until=1e12)

    def broken(session: Any) -> dict[str, Any]:
        store.models.add(session, json.dumps(model_document()), None, now())
        return {"rmse_w": float("nan")}

    with pytest.raises(ValueError, match="JSON"):
        store.jobs.finish(job["id"], broken)
    assert store.models.all() == []
    kept = store.jobs.get(job["id"])
    assert kept is not None
    assert kept["state"] == "running"


def test_old_finished_jobs_are_forgotten(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job_rows, "KEPT", 3)
    made = [store.jobs.create("compare", {"number": k})["id"] for k in range(6)]
    for job in made[:5]:
        store.jobs.cancel(job)
    store.jobs.create("compare", {})
    left = {job["id"] for job in store.jobs.newest(100)}
    assert left & set(made) == {made[2], made[3], made[4], made[5]}
