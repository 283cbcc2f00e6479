"""The workbench over HTTP: uploads, verbs as jobs, versions of models; every error one problem."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import AsyncIterator, Callable, Coroutine
from pathlib import Path
from typing import Any

import httpx
import jsonschema
import pytest

from planner.errors import LogError, ModelError
from planner.power.model import PowerModel
from planner.power.saved_model import SavedModel
from planner.power.vehicle import load_vehicle
from service.app import create_app
from service.jobs.outcomes import Adopted
from service.jobs.tasks import Task
from service.jobs.telemetry import check_model
from service.settings import Settings
from service.store import database as databases
from service.store.store import Store
from tests.service import telemetry_documents as documents
from tests.service.conftest import Http, ScriptedWorkers, locked, talking
from tests.service.route_documents import answer
from tests.service.test_http import GOOD, JSON, expect_problem

CSV = b"run,time,vx,vy,wz,power\n1,1,0.5,0,0,12\n"
FOUND = {
    "rows": 1,
    "runs": 1,
    "duration_s": 1.0,
    "present": ["power", "vx"],
    "report": [{"kind": "gap", "column": "time", "rows": 1, "sentence": "a gap"}],
    "derived": [],
    "assumed": ["flat"],
}
SAVED = json.dumps(documents.model_document(2), indent=2) + "\n"


class Workbench:
    """Does in this process what a worker would, and remembers each task."""

    def __init__(self) -> None:
        self.tasks: list[tuple[str, Any]] = []
        self.read: list[bytes] = []
        self.refusal: Exception | None = None
        self.hang = False
        self.saved = SAVED

    def __call__(self, job: str, arguments: tuple[Any, ...]) -> Any:
        if job == "solve":
            return json.dumps(answer())
        self.tasks.append((job, arguments[0]))
        if self.refusal is not None:
            raise self.refusal
        if self.hang:
            return asyncio.Event().wait()
        if job == "check_log":
            task: Task = arguments[0]
            self.read.append((Path(task.folder) / task.log).read_bytes())
            return FOUND
        return {
            "compare_log": {**documents.comparison(), "pictures": {"curves": {}, "cloud": {}}},
            "diagnose_log": documents.diagnosis(),
            "adopt_effects": Adopted(documents.adoption(), SAVED),
            "revert_model": json.dumps(documents.model_document(3)),
            "check_model": self.saved,
        }[job]


@pytest.fixture
def bench(workers: ScriptedWorkers) -> Workbench:
    """What the workers do."""
    made = Workbench()
    workers.work = made
    return made


def talk(
    settings: Settings,
    workers: ScriptedWorkers,
    conversation: Callable[[httpx.AsyncClient], Coroutine[Any, Any, None]],
) -> None:
    """Several requests to one service."""

    async def all_of_it() -> None:
        async with talking(create_app(settings, workers)) as client:
            await conversation(client)

    asyncio.run(asyncio.wait_for(all_of_it(), timeout=60))


async def upload(client: httpx.AsyncClient, content: bytes = CSV, **named: Any) -> httpx.Response:
    return await client.post("/v1/logs", files={"log": ("drive.csv", content)}, **named)


async def finished(client: httpx.AsyncClient, job: str) -> dict[str, Any]:
    while (found := (await client.get(f"/v1/jobs/{job}")).json())["state"] in ("queued", "running"):
        await asyncio.sleep(0.01)
    return dict(found)


# Logs


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


@pytest.mark.parametrize("form", [True, False])
def test_a_log_that_is_too_large_is_refused_while_it_comes(
    http: Http, bench: Workbench, settings: Settings, form: bool
) -> None:
    large = b"x" * 100_001
    sent: dict[str, Any] = {"files": {"log": ("l.csv", large)}} if form else {"content": large}
    expect_problem(http.post("/v1/logs", **sent), 413)
    assert bench.tasks == []
    assert settings.store_dir is not None
    assert [*(settings.store_dir / "incoming").iterdir()] == []


BOUNDARY = {"content-type": "multipart/form-data; boundary=b"}
PART = b'--b\r\nContent-Disposition: form-data; name="log"; filename="l.csv"\r\n\r\nx\r\n'


@pytest.mark.parametrize(
    ("content", "headers", "status"),
    [
        (b"", {}, 422),
        (b"", BOUNDARY, 422),
        (b"nonsense", BOUNDARY, 422),
        (PART, BOUNDARY, 422),
        (PART + PART + b"--b--\r\n", BOUNDARY, 422),
        (PART.replace(b"log", b"file") + b"--b--\r\n", BOUNDARY, 422),
        (PART.replace(b"log", b"other") * 30 + b"--b--\r\n", BOUNDARY, 422),
        (PART.replace(b"log", b"x").replace(b"x\r\n", b"x" * 70_000) + b"--b--\r\n", BOUNDARY, 413),
        (b"--b\r\n" + b"h: " + b"v" * 100_000 + b"\r\n\r\n", BOUNDARY, 422),
        (CSV, {"content-type": "multipart/form-data; boundary=" + "b" * 300}, 422),
    ],
)
def test_a_body_that_is_no_upload_is_one_problem(
    http: Http, bench: Workbench, content: bytes, headers: dict[str, str], status: int
) -> None:
    expect_problem(http.post("/v1/logs", content=content, headers=headers), status)
    assert bench.tasks == []
    assert http.get("/v1/logs").json() == []


def test_a_page_of_another_site_cannot_upload(http: Http, bench: Workbench) -> None:
    headers = {"sec-fetch-site": "cross-site"}
    expect_problem(http.post("/v1/logs", files={"log": CSV}, headers=headers), 409)
    assert bench.tasks == []


def test_an_upload_is_never_whole_in_memory(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    """The sender looks at the disk between two pieces: the first one is there already."""
    piece = b"x" * 3_000_000
    seen: list[int] = []

    async def conversation(client: httpx.AsyncClient) -> None:
        assert settings.store_dir is not None
        incoming = settings.store_dir / "incoming"

        async def pieces() -> AsyncIterator[bytes]:
            for _ in range(3):
                yield piece
                seen.append(sum(file.stat().st_size for file in incoming.iterdir()))

        assert (await client.post("/v1/logs", content=pieces())).status_code == 201

    roomy = settings.model_copy(update={"max_log_bytes": 10_000_000})
    talk(roomy, workers, conversation)
    assert seen[-1] > 0
    assert len(bench.read[0]) == 9_000_000


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


# Verbs


@pytest.mark.parametrize(
    ("verb", "document"), [("compare", documents.comparison()), ("diagnose", documents.diagnosis())]
)
def test_a_verb_is_a_job_and_waits_when_asked(
    bench: Workbench,
    workers: ScriptedWorkers,
    settings: Settings,
    verb: str,
    document: dict[str, Any],
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        asked = {"log": log, "vehicle": "minibalance"}
        response = await client.post(f"/v1/{verb}", json=asked)
        assert response.status_code == 202
        job = response.json()
        assert response.headers["location"] == f"/v1/jobs/{job['id']}"
        assert (job["kind"], job["request"]) == (verb, asked)
        done = await finished(client, job["id"])
        assert {**done["result"], "pictures": 0} == {**document, "pictures": 0}
        assert done["error"] is None
        waited = await client.post(f"/v1/{verb}", params={"wait": 20}, json=asked)
        assert (waited.status_code, waited.json()) == (200, done["result"])
        name, task = bench.tasks[-1]
        assert name == f"{verb}_log"
        assert (task.vehicle, task.model, task.log) == ("minibalance", None, "drive.csv")
        listed = (await client.get("/v1/jobs")).json()
        assert [entry["kind"] for entry in listed] == [verb, verb, "check"]
        assert "result" not in listed[0]

    talk(settings, workers, conversation)


def test_adopting_keeps_a_version_that_plans(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        asked = {"log": log, "vehicle": "minibalance", "effects": "air_drag, viscous_drag"}
        adopted = (await client.post("/v1/adopt?wait=20", json=asked)).json()
        assert adopted["after"] == documents.adoption()["after"]
        assert bench.tasks[-1][1].effects == ("air_drag", "viscous_drag")
        model = adopted["model_id"]
        # The saved model, letter by letter.
        assert (await client.get(f"/v1/models/{model}")).text == SAVED
        (listed,) = (await client.get("/v1/models")).json()
        assert (listed["id"], listed["version"], listed["parent_id"]) == (model, 2, None)
        assert (await client.get(f"/v1/models/{model}/history")).json()[0]["id"] == model
        # A route with it: the worker gets the path of a file that holds it.
        route = {**GOOD, "vehicle": None, "model": model}
        assert (await client.post("/v1/routes", json=route)).status_code == 200
        request = workers.asked[-1][1][0]
        assert Path(request.model).read_text() == SAVED
        # The next adoption starts from it, and knows its parent.
        further = {"log": log, "model": model, "effects": ["diagnosed"]}
        second = (await client.post("/v1/adopt?wait=20", json=further)).json()["model_id"]
        assert Path(bench.tasks[-1][1].model).read_text() == SAVED
        parents = {m["id"]: m["parent_id"] for m in (await client.get("/v1/models")).json()}
        assert parents == {model: None, second: model}

    talk(settings, workers, conversation)


def test_a_formula_goes_to_the_worker_as_it_came(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    tow = {"name": "tow", "formula": "k * vx", "unit": "W", "parameters": {"k": {"unit": "N"}}}

    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        asked = {"log": log, "vehicle": "minibalance", "formula": tow}
        assert (await client.post("/v1/adopt?wait=20", json=asked)).status_code == 200
        assert bench.tasks[-1][1].definition == tow

    talk(settings, workers, conversation)


def test_a_refusal_of_the_planner_is_its_problem(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        bench.refusal = LogError("drive.csv", "has one run", accepted="two runs")
        asked = {"log": log, "vehicle": "minibalance"}
        response = await client.post("/v1/diagnose?wait=20", json=asked)
        assert expect_problem(response, 422)["accepted"] == "two runs"
        bench.refusal = ZeroDivisionError("secret detail")
        document = expect_problem(await client.post("/v1/diagnose?wait=20", json=asked), 500)
        assert "secret" not in json.dumps(document)

    talk(settings, workers, conversation)


def test_waiting_ends_when_the_job_is_cancelled(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        bench.hang = True
        asked = {"log": log, "vehicle": "minibalance"}
        waiting = asyncio.ensure_future(client.post("/v1/compare?wait=60", json=asked))
        while not (jobs := [j for j in await running(client) if j["kind"] == "compare"]):
            await asyncio.sleep(0.01)
        await client.delete(f"/v1/jobs/{jobs[0]['id']}")
        assert expect_problem(await waiting, 409)["detail"] == "the job was cancelled"

    async def running(client: httpx.AsyncClient) -> list[dict[str, Any]]:
        listed: list[dict[str, Any]] = (await client.get("/v1/jobs")).json()
        return [job for job in listed if job["state"] == "running"]

    talk(settings, workers, conversation)


def test_a_full_queue_says_when_to_come_back(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        bench.hang = True
        asked = {"log": log, "vehicle": "minibalance"}
        # One runs, two wait.
        for _ in range(3):
            assert (await client.post("/v1/compare", json=asked)).status_code == 202
        response = await client.post("/v1/compare", json=asked)
        expect_problem(response, 503)
        assert int(response.headers["retry-after"]) >= 1

    talk(settings, workers, conversation)


@pytest.mark.parametrize(
    ("verb", "body", "field"),
    [
        ("compare", "{", "request"),
        ("compare", "null", "request"),
        ("compare", "[" * 2000, "request"),
        ("compare", '{"vehicle": "minibalance"}', "log"),
        ("compare", '{"log": "x"}', "request"),
        ("compare", '{"log": "x", "vehicle": "v", "model": "m"}', "request"),
        ("compare", '{"log": "x", "vehicel": "v"}', "vehicel"),
        ("compare", '{"log": "\\ud800", "vehicle": "v"}', "request"),
        ("compare", '{"log": 3, "vehicle": "v"}', "log"),
        ("compare", '{"log": "../../etc", "vehicle": "minibalance"}', "log"),
        ("diagnose", '{"log": "' + "x" * 1500 + '", "vehicle": "minibalance"}', "log"),
        ("adopt", '{"log": "x", "vehicle": "minibalance"}', "request"),
        ("adopt", '{"log": "x", "vehicle": "minibalance", "effects": [1]}', "effects.0"),
        ("adopt", '{"log": "x", "vehicle": "minibalance", "formula": {"k": NaN}}', "formula"),
        ("adopt", '{"log": "x", "vehicle": "minibalance", "formula": "x"}', "formula"),
        ("models/x/revert", '{"version": 0}', "version"),
        ("models/x/revert", '{"version": "two"}', "version"),
    ],
)
def test_a_hostile_body_is_one_problem_and_reaches_no_worker(
    http: Http, bench: Workbench, verb: str, body: str, field: str
) -> None:
    document = expect_problem(http.post(f"/v1/{verb}", content=body, headers=JSON), 422)
    assert document["field"] == field
    assert document["accepted"]
    assert bench.tasks == []


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/v1/logs/nothing", 404),
        ("DELETE", "/v1/logs/nothing", 404),
        ("GET", "/v1/logs/..%2F..%2Fjoulepath.db", 404),
        ("GET", "/v1/jobs/nothing", 404),
        ("DELETE", "/v1/jobs/nothing", 404),
        ("GET", "/v1/jobs?most=0", 422),
        ("GET", "/v1/models/nothing", 404),
        ("GET", "/v1/models/%00%ff", 404),
        ("GET", "/v1/models/nothing/history", 404),
        ("POST", "/v1/compare?wait=1e9", 422),
        ("GET", "/v1/compare", 405),
        ("POST", "/v1/compare", 415),
        ("POST", "/v1/models", 415),
    ],
)
def test_other_errors_are_problems_too(
    http: Http, bench: Workbench, method: str, path: str, status: int
) -> None:
    expect_problem(http.request(method, path), status)


# Models


def test_a_saved_model_is_uploaded_and_reverted(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        response = await client.post("/v1/models", content=SAVED, headers=JSON)
        assert response.status_code == 201
        first = response.json()
        assert response.headers["location"] == f"/v1/models/{first['id']}"
        assert bench.tasks[-1] == ("check_model", SAVED.encode())
        reverted = await client.post(f"/v1/models/{first['id']}/revert", json={"version": 1})
        assert reverted.status_code == 201
        assert (reverted.json()["version"], reverted.json()["parent_id"]) == (3, first["id"])
        entries = (await client.get(f"/v1/models/{reverted.json()['id']}/history")).json()
        assert [entry["id"] for entry in entries] == [first["id"], reverted.json()["id"]]
        missing = await client.post("/v1/models/nothing/revert", json={"version": 1})
        expect_problem(missing, 404)

    talk(settings, workers, conversation)


def test_a_model_that_cannot_be_used_is_refused(http: Http, bench: Workbench) -> None:
    bench.refusal = ModelError("model.json", "not a joulepath model", accepted="a file")
    expect_problem(http.post("/v1/models", json={"format": "?"}), 422)
    assert http.get("/v1/models").json() == []
    large = b" " * ((1 << 20) + 1)
    expect_problem(http.post("/v1/models", content=large, headers=JSON), 413)


SAVED_BY_HAND: dict[str, Any] = json.loads(SAVED)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({}, None),
        ({"name": ["x"]}, "name"),
        ({"version": "two"}, "version"),
        ({"version": 0}, "version"),
        ({"history": "x"}, "history"),
        ({"history": [{"version": 1}]}, "history.0.action"),
        (
            {"history": [{**documents.entry(2), "after": {"rmse_w": "low"}}]},
            "history.0.after.rmse_w",
        ),
    ],
)
def test_what_the_service_reads_in_a_saved_model(
    changes: dict[str, Any], field: str | None
) -> None:
    document = {**SAVED_BY_HAND, **changes}
    if field is None:
        SavedModel.check(document)
        return
    with pytest.raises(ModelError) as caught:
        SavedModel.check(document)
    assert caught.value.field == field


@pytest.mark.parametrize(
    "content",
    [b"", b"null", b"\xff", b"[" * 100_000, b'{"format": "joulepath-model/1"}'],
)
def test_a_hostile_model_is_refused_by_the_worker(content: bytes) -> None:
    assert isinstance(check_model(content), ModelError)


def test_a_saved_model_comes_out_of_the_worker_as_it_went_in(tmp_path: Path) -> None:
    model = PowerModel.from_vehicle(load_vehicle("minibalance"), effects=["air_drag"])
    model.save(tmp_path / "m.json")
    content = (tmp_path / "m.json").read_bytes()
    assert check_model(content) == content.decode()
    for value in (math.nan, 10**400, "\ud800"):
        spoilt = json.loads(content)
        spoilt["effects"]["electronics"]["power"] = value
        assert isinstance(check_model(json.dumps(spoilt).encode()), ModelError)


def test_a_route_names_a_model_that_is_not_there(http: Http, bench: Workbench) -> None:
    route = {**GOOD, "vehicle": None, "model": "nothing"}
    document = expect_problem(http.post("/v1/routes", json=route), 422)
    assert document["field"] == "model"
    assert "GET /v1/models" in document["accepted"]


# The OpenAPI document


def test_answers_and_examples_fit_the_openapi_document(
    bench: Workbench, workers: ScriptedWorkers, settings: Settings
) -> None:
    async def conversation(client: httpx.AsyncClient) -> None:
        openapi = (await client.get("/openapi.json")).json()
        parts = {"components": openapi["components"]}

        def fits(document: Any, path: str, method: str, status: str) -> None:
            described = openapi["paths"][path][method]["responses"][status]
            schema = described["content"]["application/json"]["schema"]
            jsonschema.validate(document, {**schema, **parts})

        log = (await upload(client)).json()
        fits(log, "/v1/logs", "post", "201")
        fits((await client.get("/v1/logs")).json(), "/v1/logs", "get", "200")
        for verb in ("compare", "diagnose", "adopt"):
            path = f"/v1/{verb}"
            body = openapi["paths"][path]["post"]["requestBody"]["content"]["application/json"]
            jsonschema.validate(body["example"], {**body["schema"], **parts})
            asked = {**body["example"], "log": log["id"]}
            job = (await client.post(path, json=asked)).json()
            fits(job, path, "post", "202")
            done = await finished(client, job["id"])
            fits(done, "/v1/jobs/{job}", "get", "200")
            fits(done["result"], path, "post", "200")
        fits((await client.get("/v1/jobs")).json(), "/v1/jobs", "get", "200")
        models = (await client.get("/v1/models")).json()
        fits(models, "/v1/models", "get", "200")
        history = (await client.get(f"/v1/models/{models[0]['id']}/history")).json()
        fits(history, "/v1/models/{model}/history", "get", "200")

    talk(settings, workers, conversation)


def test_the_store_is_closed_with_the_service(http: Http, settings: Settings) -> None:
    http.get("/v1/logs")
    Store.open(settings).close()


# A database that another program holds


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("POST", "/v1/compare", {"json": {"log": "LOG", "vehicle": "minibalance"}}),
        ("POST", "/v1/logs", {"files": {"log": ("other.csv", CSV + b"1,2,0.5,0,0,12\n")}}),
        ("POST", "/v1/models", {"content": SAVED, "headers": JSON}),
        ("DELETE", "/v1/logs/LOG", {}),
    ],
)
def test_a_locked_database_is_said_with_when_to_try_again(
    settings: Settings,
    workers: ScriptedWorkers,
    bench: Workbench,
    monkeypatch: pytest.MonkeyPatch,
    method: str,
    path: str,
    body: dict[str, Any],
) -> None:
    monkeypatch.setattr(databases, "PATIENCE_S", 0)

    async def conversation(client: httpx.AsyncClient) -> None:
        log = (await upload(client)).json()["id"]
        asked = json.loads(json.dumps(body).replace("LOG", log)) if "json" in body else body
        where = path.replace("LOG", log)
        with locked(settings.store_dir or Path()):
            refused = await client.request(method, where, **asked)
            problem = expect_problem(refused, 503)
            assert problem["type"] == "urn:joulepath:problem:database-locked"
            assert "try again" in problem["detail"]
            # What only reads is answered.
            assert [entry["id"] for entry in (await client.get("/v1/logs")).json()] == [log]
        assert int(refused.headers["Retry-After"]) >= 1
        # Nothing was left behind, and the same request is good afterwards.
        folders = (settings.store_dir or Path()) / "logs"
        assert [folder.name for folder in folders.iterdir()] == [log]
        assert (await client.request(method, where, **asked)).status_code < 300

    talk(settings, workers, conversation)
