"""What requests may name is listed."""

from __future__ import annotations

import json

from service.settings import Settings
from tests.service.conftest import Http, ScriptedWorkers
from tests.service.http.exchanges import GOOD, expect_problem


def test_files_in_the_folder_are_named_by_their_place_in_it(
    http: Http, workers: ScriptedWorkers, settings: Settings
) -> None:
    names = [entry["name"] for entry in http.get("/v1/maps").json()]
    assert names == ["warehouse", "site/yard.tif"]
    http.post("/v1/routes", json={**GOOD, "map": "site/yard.tif", "vehicle": "cart.toml"})
    _, (request, *_) = workers.asked[-1]
    folder = settings.data_dir
    assert folder is not None
    assert request.map == str(folder.resolve() / "site" / "yard.tif")
    assert request.vehicle == str(folder.resolve() / "cart.toml")


def test_catalogues_list_names(http: Http) -> None:
    assert http.get("/v1/vehicles").json()[0] == {
        "name": "minibalance",
        "title": None,
        "battery_j": None,
    }
    assert http.get("/v1/effects").json()[0]["name"] == "gravity"


def test_relief_is_read_by_a_worker(http: Http, workers: ScriptedWorkers) -> None:
    workers.work = lambda job, arguments: json.dumps({"job": job, "arguments": arguments})
    response = http.get("/v1/maps/site/yard.tif/relief", params={"most": 64})
    assert response.json()["job"] == "relief"
    assert response.json()["arguments"][1] == 64


def test_ground_is_looked_at_for_a_robot(http: Http, workers: ScriptedWorkers) -> None:
    workers.work = lambda job, arguments: json.dumps({"job": job, "arguments": arguments})
    answer = http.get("/v1/maps/warehouse/ground", params={"vehicle": "minibalance"}).json()
    assert answer == {"job": "ground", "arguments": ["warehouse", "minibalance", None]}
    for wrong in ({"vehicle": "tank"}, {"model": "lost"}):
        expect_problem(http.get("/v1/maps/warehouse/ground", params=wrong), 404)
    expect_problem(http.get("/v1/maps/nowhere/ground"), 404)
