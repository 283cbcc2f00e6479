"""The questions about routes: answers are passed on, and every error is one problem."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from planner.errors import MapError
from service.http import create_app
from service.problems import Busy, TookTooLong, WorkerLost
from service.settings import Settings
from tests.service.conftest import Http, ScriptedWorkers
from tests.service.http.exchanges import GOOD, JSON, TEXT, expect_problem
from tests.service.route_documents import answer


def test_a_route_is_passed_on_as_the_worker_wrote_it(http: Http, workers: ScriptedWorkers) -> None:
    response = http.post("/v1/routes", json=GOOD)
    assert response.status_code == 200
    assert response.json() == answer()
    job, (request, *_) = workers.asked[-1]
    assert job == "plan_route"
    assert (request.map, request.start.x) == ("warehouse", 1.5)


def test_no_route_is_an_answer(http: Http, workers: ScriptedWorkers) -> None:
    workers.work = lambda *_: json.dumps({**answer(), "status": "no_route", "reason": "a wall"})
    response = http.post("/v1/routes", json=GOOD)
    assert response.status_code == 200
    assert response.json()["reason"] == "a wall"


@pytest.mark.parametrize(
    ("body", "field"),
    [
        (TEXT.replace("1.5", "NaN"), "start.x"),
        (TEXT.replace("1.5", "Infinity"), "start.x"),
        (TEXT.replace("1.5", "1e400"), "start.x"),
        (TEXT.replace("1.5", '"1.5"'), "start.x"),
        (TEXT.replace("1.5", "true"), "start.x"),
        (TEXT.replace("warehouse", "\\ud800"), "map"),
        (TEXT.replace("warehouse", "ware\\u0000house"), "map"),
        (TEXT.replace('"start"', '"\\udfff"'), "request"),
        (TEXT.replace('"start"', '"strat"'), "strat"),
        (TEXT[:-1] + ', "map": "other"}', "map"),
        (TEXT[:-1] + ', "time_budget_s": 11}', "time_budget_s"),
        (TEXT[:-1] + ', "seed": ' + "9" * 1500 + "}", "seed"),
        ("[" * 2000, "request"),
        ("", "request"),
        ("nothing", "request"),
        ("null", "request"),
        (b"\xff\xfe\x00", "request"),
    ],
)
def test_a_hostile_body_is_one_problem_and_reaches_no_worker(
    http: Http, workers: ScriptedWorkers, body: str | bytes, field: str
) -> None:
    document = expect_problem(http.post("/v1/routes", content=body, headers=JSON), 422)
    assert document["field"] == field
    assert document["accepted"]
    assert workers.asked == []


def test_a_body_that_is_too_large_is_refused(http: Http) -> None:
    padded = TEXT + " " * 3000
    said = expect_problem(http.post("/v1/routes", content=padded, headers=JSON), 413)["detail"]
    assert said == "the body is larger than 2048 bytes, the service's JOULEPATH_MAX_BODY_BYTES"


def test_graphs_have_a_limit_of_their_own(http: Http, workers: ScriptedWorkers) -> None:
    asked = {"map": "warehouse", "graph": {"type": "FeatureCollection", "features": []}}
    padded = json.dumps(asked) + " " * 100_000
    assert http.post("/v1/graphs", content=padded, headers=JSON).status_code == 200
    assert len(workers.asked) == 1
    huge = padded + " " * 5_000_000
    said = expect_problem(http.post("/v1/graphs", content=huge, headers=JSON), 413)["detail"]
    assert "4194304 bytes, the service's JOULEPATH_MAX_GRAPH_BYTES" in said


def test_a_body_that_is_not_said_to_be_json_is_refused(http: Http) -> None:
    expect_problem(
        http.post("/v1/routes", content=TEXT, headers={"content-type": "text/plain"}), 415
    )
    expect_problem(http.post("/v1/routes", data={"map": "warehouse"}), 415)


def test_a_refusal_of_the_planner_names_its_field(http: Http, workers: ScriptedWorkers) -> None:
    def refuse(*_: Any) -> Any:
        raise MapError("map", "holds no heights", value="warehouse", accepted="a GeoTIFF")

    workers.work = refuse
    document = expect_problem(http.post("/v1/routes", json=GOOD), 422)
    assert (document["field"], document["accepted"]) == ("map", "a GeoTIFF")


def test_a_full_queue_says_when_to_come_back(http: Http, workers: ScriptedWorkers) -> None:
    def refuse(*_: Any) -> Any:
        raise Busy(retry_after_s=8)

    workers.work = refuse
    response = http.post("/v1/routes", json=GOOD)
    expect_problem(response, 503)
    assert response.headers["retry-after"] == "8"


@pytest.mark.parametrize(("error", "status"), [(TookTooLong("2 s"), 504), (WorkerLost("x"), 500)])
def test_an_ended_job_is_said(
    http: Http, workers: ScriptedWorkers, error: Exception, status: int
) -> None:
    def fail(*_: Any) -> Any:
        raise error

    workers.work = fail
    expect_problem(http.post("/v1/routes", json=GOOD), status)


@pytest.mark.parametrize(
    ("field", "name"),
    [
        ("map", "/etc/passwd"),
        ("map", "../secret.tif"),
        ("map", "site/../../secret.tif"),
        ("map", "leak.tif"),
        ("map", "cart.toml"),
        ("map", "data/site/yard.tif"),
        ("vehicle", "site/yard.tif"),
        ("vehicle", "planner/power/vehicles/minibalance.toml"),
    ],
)
def test_requests_reach_no_file_outside_the_folder(
    http: Http, workers: ScriptedWorkers, field: str, name: str
) -> None:
    document = expect_problem(http.post("/v1/routes", json={**GOOD, field: name}), 422)
    assert document["field"] == field
    assert workers.asked == []


def test_a_client_that_hangs_up_ends_its_job(settings: Settings, workers: ScriptedWorkers) -> None:
    """Spoken to as a server would: the body comes, then the news that the client is gone."""

    async def talk() -> list[dict[str, Any]]:
        app = create_app(settings, workers)
        sent: list[dict[str, Any]] = []
        begun = asyncio.Event()

        async def never() -> str:
            begun.set()
            await asyncio.Event().wait()
            return ""

        workers.work = lambda *_: never()
        told = iter([{"type": "http.request", "body": TEXT.encode(), "more_body": False}])

        async def receive() -> dict[str, Any]:
            message = next(told, None)
            if message is not None:
                return message
            await begun.wait()
            return {"type": "http.disconnect"}

        async def send(message: Any) -> None:
            sent.append(message)

        scope = {
            "type": "http",
            "asgi": {"version": "3.0"},
            "http_version": "1.1",
            "method": "POST",
            "scheme": "http",
            "path": "/v1/routes",
            "raw_path": b"/v1/routes",
            "query_string": b"",
            "headers": [(b"content-type", b"application/json")],
            "client": ("127.0.0.1", 1),
            "server": ("127.0.0.1", 8000),
        }
        async with app.router.lifespan_context(app):
            await asyncio.wait_for(app(scope, receive, send), timeout=10)
            await asyncio.sleep(0)
        return sent

    asyncio.run(talk())
    assert workers.cancelled == 1


@pytest.mark.parametrize(
    ("path", "job", "body"),
    [
        ("/v1/graphs", "energy_graph", {"map": "warehouse", "graph": {"features": []}}),
        ("/v1/matrices", "energy_matrix", {"map": "warehouse", "starts": [{"x": 2, "y": 2}]}),
        ("/v1/reachable-areas", "reachable_area", {"map": "warehouse", "start": {"x": 6, "y": 2}}),
        (
            "/v1/fronts",
            "energy_time_front",
            {"map": "warehouse", "start": {"x": 6, "y": 2}, "goal": {"x": 9, "y": 2}},
        ),
    ],
)
def test_questions_about_many_routes_reach_a_worker(
    http: Http, workers: ScriptedWorkers, path: str, job: str, body: dict[str, Any]
) -> None:
    workers.work = lambda *_: json.dumps({"said": job})
    response = http.post(path, json=body)
    assert response.status_code == 200
    assert response.json() == {"said": job}
    asked, (request, *_) = workers.asked[-1]
    assert asked == job
    assert request.map == body["map"]
    problem = expect_problem(http.post(path, json={**body, "whither": {"x": 1, "y": 1}}), 422)
    assert problem["field"] == "whither"


def test_accept_asks_the_worker_for_the_format(http: Http, workers: ScriptedWorkers) -> None:
    workers.work = lambda *_: "route,x\n"
    response = http.post("/v1/routes", json=GOOD, headers={"Accept": "text/csv"})
    assert response.headers["content-type"].startswith("text/csv")
    assert response.text == "route,x\n"
    assert workers.asked[-1][1][-1] == "csv"


def test_a_format_that_routes_do_not_have_is_refused(http: Http, workers: ScriptedWorkers) -> None:
    response = http.post("/v1/routes", json=GOOD, headers={"Accept": "image/png"})
    document = expect_problem(response, 406)
    assert document["type"].endswith(":no-such-format")
    assert "application/geo+json" in document["detail"]
    assert workers.asked == []


def lines(response: Any) -> list[Any]:
    assert response.status_code == 200
    assert response.headers["content-type"].startswith("application/x-ndjson")
    return [json.loads(line) for line in response.text.splitlines()]


@pytest.mark.parametrize("path", ["/v1/routes?progress=true&files=true&baseline_poses=true"])
def test_progress_comes_in_lines_before_the_answer(
    http: Http, workers: ScriptedWorkers, path: str
) -> None:
    async def work() -> str:
        workers.tell(0.25, "looking")
        await asyncio.sleep(0)
        workers.tell(0.5, "found")
        return json.dumps(answer())

    workers.work = lambda *_: work()
    found = lines(http.post(path, json=GOOD))
    told = [
        {"progress": {"share": 0.25, "sentence": "looking"}},
        {"progress": {"share": 0.5, "sentence": "found"}},
    ]
    assert found == [*told, {"answer": answer()}]
    # Report, files, poses of the baselines, format.
    assert workers.asked[-1][1][1:] == (False, True, True, "json")


def test_what_fails_after_progress_is_told_in_the_last_line(
    http: Http, workers: ScriptedWorkers
) -> None:
    async def work() -> str:
        workers.tell(0.25, "looking")
        await asyncio.sleep(0)
        raise MapError("map", "is no map", accepted="a map")

    workers.work = lambda *_: work()
    last = lines(http.post("/v1/routes?progress=true", json=GOOD))[-1]["problem"]
    assert (last["status"], last["field"]) == (422, "map")


def test_what_fails_before_progress_is_a_problem_as_ever(
    http: Http, workers: ScriptedWorkers
) -> None:
    def refuse(*_: Any) -> Any:
        raise Busy(7)

    workers.work = refuse
    response = http.post("/v1/routes?progress=true", json=GOOD)
    expect_problem(response, 503)
    assert response.headers["retry-after"] == "7"


def test_an_answer_without_progress_is_one_line(http: Http) -> None:
    assert lines(http.post("/v1/routes?progress=true", json=GOOD)) == [{"answer": answer()}]
