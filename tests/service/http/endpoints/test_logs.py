"""Logs are read before they are accepted, listed and removed."""

from __future__ import annotations

from pathlib import Path

import httpx
import pytest

from planner.errors import LogError
from service.settings import Settings
from tests.service.conftest import Http, ScriptedWorkers
from tests.service.http.exchanges import expect_problem
from tests.service.workbench import CSV, Workbench, talk, upload


def test_a_log_is_read_before_it_is_accepted(http: Http, bench: Workbench) -> None:
    response = http.post("/v1/logs", files={"log": ("drive.csv", CSV)})
    assert response.status_code == 201
    log = response.json()
    assert response.headers["location"] == f"/v1/logs/{log['id']}"
    assert (log["name"], log["rows"], log["assumed"]) == ("drive.csv", 1, ["flat"])
    assert bench.read == [CSV]
    # Another life of the service.
    assert http.get("/v1/logs").json()[0]["id"] == log["id"]
    assert http.get(f"/v1/logs/{log['id']}").json() == log


def test_the_same_bytes_are_the_same_log(http: Http, bench: Workbench) -> None:
    first = http.post("/v1/logs", files={"log": ("drive.csv", CSV)})
    again = http.post("/v1/logs?name=copy.csv", content=CSV)
    assert (first.status_code, again.status_code) == (201, 200)
    assert again.json() == first.json()
    mapped = {"log": ("drive.csv", CSV), "mapping": ("m.toml", b'[columns]\nvx = "v"\n')}
    other = http.post("/v1/logs", files=mapped)
    assert other.status_code == 201
    assert other.json()["id"] != first.json()["id"]
    assert other.json()["sha256"] == first.json()["sha256"]
    assert [len(bench.read), len(http.get("/v1/logs").json())] == [2, 2]
    task = bench.tasks[-1][1]
    assert (task.log, task.mapping) == ("drive.csv", "mapping.toml")
    assert (Path(task.folder) / "mapping.toml").read_bytes() == mapped["mapping"][1]


def test_a_body_alone_is_a_log_too(http: Http, bench: Workbench) -> None:
    log = http.post("/v1/logs?name=..%2Fride.parquet", content=b"PAR1" + bytes(9)).json()
    assert log["name"] == "ride.parquet"
    assert http.post("/v1/logs", content=b"x").json()["name"] == "log"


@pytest.mark.parametrize("letter", ["走", "𝒙", "\u0301", "x"])
def test_a_long_name_of_wide_characters_is_shortened(
    http: Http, bench: Workbench, letter: str
) -> None:
    named = {"files": {"log": (letter * 300 + ".csv", CSV)}}
    alone = {"params": {"name": letter * 300 + ".csv"}, "content": CSV + b"1,2,0.5,0,0,12\n"}
    for sent in (named, alone):
        response = http.post("/v1/logs", **sent)
        assert response.status_code == 201, response.text
        name = response.json()["name"]
        # No file system takes more than 255 bytes.
        assert len(name.encode()) <= 255
        assert name.endswith(".csv")
    assert bench.read == [CSV, alone["content"]]


def test_a_log_that_cannot_be_used_leaves_nothing(
    http: Http, bench: Workbench, settings: Settings
) -> None:
    bench.refusal = LogError("drive.csv", "has no column 'power'", accepted="columns")
    document = expect_problem(http.post("/v1/logs", files={"log": ("drive.csv", CSV)}), 422)
    assert document["field"] == "drive.csv"
    assert http.get("/v1/logs").json() == []
    assert settings.store_dir is not None
    assert [*(settings.store_dir / "logs").iterdir()] == []
    assert [*(settings.store_dir / "incoming").iterdir()] == []


def test_a_page_of_another_site_cannot_upload(http: Http, bench: Workbench) -> None:
    headers = {"sec-fetch-site": "cross-site"}
    expect_problem(http.post("/v1/logs", files={"log": CSV}, headers=headers), 409)
    assert bench.tasks == []


def test_a_log_that_takes_long_to_read_is_answered_as_a_job(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    bench.hang = True

    async def conversation(client: httpx.AsyncClient) -> None:
        first = await upload(client, params={"wait": 0})
        assert first.status_code == 202
        job = first.json()
        assert job["kind"] == "check"
        assert first.headers["location"] == f"/v1/jobs/{job['id']}"
        # The same log again joins the job that reads it.
        assert (await upload(client, params={"wait": 0})).json()["id"] == job["id"]
        assert (await client.delete(f"/v1/jobs/{job['id']}")).json()["state"] == "cancelled"
        bench.hang = False
        assert (await upload(client)).status_code == 201

    talk(settings, workers, conversation)


def test_a_log_is_removed_unless_a_job_reads_it(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        bench.hang = True
        asked = {"log": log, "vehicle": "minibalance"}
        job = (await client.post("/v1/diagnose", json=asked)).json()["id"]
        expect_problem(await client.delete(f"/v1/logs/{log}"), 409)
        await client.delete(f"/v1/jobs/{job}")
        assert (await client.delete(f"/v1/logs/{log}")).status_code == 204
        expect_problem(await client.delete(f"/v1/logs/{log}"), 404)
        expect_problem(await client.get(f"/v1/logs/{log}"), 404)
        assert settings.store_dir is not None
        assert [*(settings.store_dir / "logs").iterdir()] == []

    talk(settings, workers, conversation)


def test_the_demo_log_is_a_log_like_any(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        first = await client.post("/v1/logs/demo")
        assert (first.status_code, first.json()["name"]) == (201, "demo.csv")
        # The second one is the same, and nothing of it stays.
        again = await client.post("/v1/logs/demo")
        assert (again.status_code, again.json()["id"]) == (200, first.json()["id"])
        assert [*((settings.store_dir or Path()) / "incoming").iterdir()] == []

    talk(settings, workers, conversation)
    assert bench.read == [CSV]
