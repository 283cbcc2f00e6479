"""The whole way: the installed command serves, the client asks, a worker plans, Ctrl-C ends it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest

from planner.telemetry.virtual import Noise, VirtualRobot
from service.client import JoulepathClient, ServiceProblem
from tests.service.jobs.processes import Ends

JOULEPATH = Path(sys.executable).parent / "joulepath"
WAY: dict[str, Any] = {
    "map": "test-bench",
    "start": {"x": 1.0, "y": 1.5},
    "goal": {"x": 13.0, "y": 1.5},
    "seed": 3,
    "iterations": 200,
}


def started(store: Path) -> tuple[subprocess.Popen[str], str, str]:
    """A server of its own on a free port, its address, and what it said until it was ready."""
    process = subprocess.Popen(
        [JOULEPATH, "serve", "--port", "0"],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "JOULEPATH_STORE_DIR": str(store)},
    )
    assert process.stderr is not None
    said = ""
    while not (found := re.search(r"running on (http://[\d.:]+)", said)):
        line = process.stderr.readline()
        assert line, said
        said += line
    return process, found[1], said


@pytest.fixture(scope="module")
def server(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A server; must end without complaint when interrupted."""
    process, address, said = started(tmp_path_factory.mktemp("store"))
    yield process, address
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=30)
    assert "Traceback" not in said + rest
    assert "nanobind" not in said + rest


@pytest.fixture(scope="module")
def client(server: tuple[subprocess.Popen[str], str]) -> Iterator[JoulepathClient]:
    """A client of that server."""
    with JoulepathClient(server[1]) as made:
        yield made


def test_a_route_is_planned_and_its_account_adds_up(client: JoulepathClient) -> None:
    answer = client.plan(WAY)
    assert answer["status"] == "ok"
    route = answer["routes"][0]
    assert sum(route["breakdown_j"].values()) == pytest.approx(route["energy_j"], rel=1e-6)
    assert route["poses"][0]["x"] == 1.0
    assert route["poses"][-1]["x"] == pytest.approx(13.0)


def test_the_same_request_gets_the_same_answer(client: JoulepathClient) -> None:
    with ThreadPoolExecutor(2) as threads:
        one, other = threads.map(lambda _: client.plan(WAY), range(2))
    assert one == other


def test_a_refusal_comes_all_the_way_from_the_planner(client: JoulepathClient) -> None:
    with pytest.raises(ServiceProblem) as caught:
        client.plan(WAY, start={"x": -5.0, "y": 1.5})
    assert caught.value.status == 422
    assert caught.value.field == "start"


def test_the_service_knows_what_is_installed(client: JoulepathClient) -> None:
    assert "test-bench" in {entry["name"] for entry in client.maps()}
    assert "minibalance" in {entry["name"] for entry in client.vehicles()}
    assert "gravity" in {entry["name"] for entry in client.effects()}
    assert client.health()["status"] == "ok"


def descendants(pid: int) -> set[int]:
    """Processes that a process started, and those that they did."""
    children = {
        int(child)
        for task in Path(f"/proc/{pid}/task").iterdir()
        for child in (task / "children").read_text().split()
    }
    return children.union(*map(descendants, children))


def test_what_the_service_started_ends_with_it_when_it_is_killed(tmp_path: Path) -> None:
    """Nothing else ends a worker: one that was left alone would wait for its next request."""
    process, address, _ = started(tmp_path / "store")
    with process, ThreadPoolExecutor(1) as threads, JoulepathClient(address) as client:
        before = descendants(process.pid)
        # A sampler goes on until the end of its budget; the default planner ends when it is done.
        asked = threads.submit(client.plan, WAY, planner="rrt*", time_budget_s=50)
        while client.health()["workers"]["busy"] == 0:
            assert not asked.done()
        running = before | descendants(process.pid)
        assert len(running) >= 3
        ends = Ends(running)
        process.kill()
        process.wait()
        assert ends.within(30.0) == set()
        with pytest.raises(httpx.TransportError):
            asked.result()


def test_a_log_is_uploaded_read_and_removed(client: JoulepathClient) -> None:
    rows = "\n".join(f"a,{0.5 * k},{0.01 * k},0,0,{10 + 0.1 * k}" for k in range(1, 50))
    log = client.upload_log(f"run,time,vx,vy,wz,power\n{rows}\n".encode(), name="drive.csv")
    assert (log["name"], log["rows"], log["runs"]) == ("drive.csv", 49, 1)
    assert "the ground is taken as flat" in " ".join(log["assumed"])
    assert [entry["id"] for entry in client.logs()] == [log["id"]]
    with pytest.raises(ServiceProblem) as caught:
        client.upload_log(b"run,time,vx,vy,wz\n1,0,0,0,0\n", name="broken.csv")
    assert caught.value.status == 422
    # The log is called by its name, not by where the service keeps it.
    assert caught.value.field == "broken.csv"
    assert "power" in str(caught.value)
    client.delete_log(log["id"])
    assert client.logs() == []


def test_what_a_log_teaches_is_planned_with(
    server: tuple[subprocess.Popen[str], str], client: JoulepathClient, tmp_path: Path
) -> None:
    """The virtual robot meets the air; the base model does not know it, the next version does."""
    robot = VirtualRobot("minibalance", hidden={"air_drag": {"size": 0.1}}, seed=2)
    drive = robot.drive(robot.profile("rich", runs=9, rows=120), noise=Noise(level=0.02))
    drive.write_csv(tmp_path / "drive.csv")
    log = client.upload_log(tmp_path / "drive.csv")
    told: list[tuple[float, str]] = []
    before = client.compare(
        log["id"], vehicle="minibalance", progress=lambda *now: told.append(now)
    )
    assert before["log"]["source"] == "drive.csv"
    assert "speed" in before["pictures"]["curves"]
    assert told[-1] == (1.0, "done")
    adopted = client.adopt("air_drag", log["id"], vehicle="minibalance")
    assert adopted["after"]["heldout_rmse_w"] < 0.7 * adopted["before"]["heldout_rmse_w"]
    model = adopted["model_id"]
    assert client.history(model)[-1]["log"]["sha256"] == log["sha256"]
    # The version by itself, on the log that it learnt from.
    after = client.compare(log["id"], model=model)
    assert (after["fitted"], after["model"]["version"]) == (False, 2)
    assert after["rmse_w"] < 0.7 * before["rmse_w"]
    route = client.plan({k: v for k, v in WAY.items() if k != "vehicle"}, model=model)
    assert route["routes"][0]["breakdown_j"]["air_drag"] > 0
    assert client.revert(model, 1)["version"] == 3
    # Its file is what the command line reads.
    assert client.upload_model(client.model(model))["version"] == 2
    # All of this was done in processes of its own: what the service's process has loaded.
    assert client.maps()
    assert client.vehicles()
    assert client.effects()
    loaded = Path(f"/proc/{server[0].pid}/maps").read_text()
    assert "/pydantic_core/" in loaded
    for package in ("llvmlite", "numba", "ompl", "scipy", "numpy", "rasterio", "pyarrow"):
        assert f"/{package}" not in loaded


def test_a_store_that_cannot_be_used_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = subprocess.run(
        [JOULEPATH, "serve", "--port", "0"],
        capture_output=True,
        text=True,
        env={**os.environ, "JOULEPATH_STORE_DIR": str(tmp_path / "file")},
        timeout=60,
    )
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert "JOULEPATH_STORE_DIR" in done.stderr
