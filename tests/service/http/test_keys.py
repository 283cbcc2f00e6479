"""API keys: nothing of a user without one, and no address for others without a decision."""

import pytest
from pydantic import SecretStr, ValidationError

from planner.errors import InputError
from service.http import create_app
from service.http.keys import check_address, known
from service.settings import Settings
from tests.service.conftest import Http, ScriptedWorkers
from tests.service.http.exchanges import GOOD, expect_problem

KEYS = ("first-key", "second.key")


@pytest.fixture
def guarded(workers: ScriptedWorkers, settings: Settings) -> Http:
    """A service that two keys open."""
    given = settings.model_copy(update={"api_keys": SecretStr(" first-key, second.key,")})
    return Http(create_app(given, workers))


@pytest.mark.parametrize("path", ["/", "/healthz", "/report.css", "/report.js", "/static/api.js"])
def test_what_holds_nothing_of_a_user_needs_no_key(guarded: Http, path: str) -> None:
    assert guarded.get(path).status_code == 200


@pytest.mark.parametrize("path", ["/v1/maps", "/v1/logs", "/openapi.json", "/static", "//v1/maps"])
def test_everything_else_does(guarded: Http, path: str) -> None:
    response = guarded.get(path)
    assert expect_problem(response, 401)["type"].endswith(":no-key")
    assert response.headers["www-authenticate"] == "Bearer"


@pytest.mark.parametrize(
    "header",
    ["", "Bearer", "Bearer ", "Bearer first", "Bearer first-key2", "Basic first-key", "first-key"],
)
def test_a_wrong_key_reaches_no_worker(
    guarded: Http, workers: ScriptedWorkers, header: str
) -> None:
    before = list(workers.asked)
    response = guarded.post("/v1/routes", json=GOOD, headers={"Authorization": header})
    expect_problem(response, 401)
    assert [job for job, _ in workers.asked[len(before) :] if job == "plan_route"] == []


@pytest.mark.parametrize("key", KEYS)
def test_each_key_opens_the_service(guarded: Http, key: str) -> None:
    headers = {"Authorization": f"Bearer {key}"}
    assert guarded.post("/v1/routes", json=GOOD, headers=headers).status_code == 200


def test_the_page_exchanges_a_key_for_a_cookie_that_scripts_cannot_read(guarded: Http) -> None:
    expect_problem(guarded.post("/key", json={"key": "wrong"}), 401)
    expect_problem(guarded.post("/key", json={"key": ""}), 422)
    response = guarded.post("/key", json={"key": "second.key"})
    assert response.status_code == 204
    cookie = response.headers["set-cookie"]
    assert "httponly" in cookie.lower()
    assert "samesite=strict" in cookie.lower()
    pair = cookie.split(";")[0]
    assert guarded.get("/v1/maps", headers={"Cookie": pair}).status_code == 200
    expect_problem(guarded.get("/v1/maps", headers={"Cookie": "joulepath-key=wrong"}), 401)


def test_without_keys_nobody_is_asked(http: Http) -> None:
    assert http.get("/v1/maps").status_code == 200


def test_no_key_is_known_where_there_is_none() -> None:
    assert not known("", ())
    assert not known("", KEYS)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.1.2.3", "::1", "localhost"])
def test_this_machine_needs_no_key(host: str) -> None:
    check_address(host, Settings())


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.0.7", "robot.local"])
def test_others_need_a_key_or_a_decision(host: str) -> None:
    with pytest.raises(InputError, match="JOULEPATH_API_KEYS"):
        check_address(host, Settings())
    check_address(host, Settings(open=True))
    check_address(host, Settings(api_keys=SecretStr("first-key")))


def test_a_key_that_no_header_holds_is_refused() -> None:
    with pytest.raises(ValidationError, match="letters, digits"):
        Settings(api_keys=SecretStr("schlüssel"))
