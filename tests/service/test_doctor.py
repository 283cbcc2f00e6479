"""The check of an installation: sound, and with one thing broken at a time."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from service import cli, doctor
from service.doctor import Finding, examine


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No plan and no diagnosis, and a store of its own."""
    monkeypatch.setattr(doctor, "TRIALS", {"a plan": lambda: None})
    monkeypatch.setenv("JOULEPATH_STORE_DIR", str(tmp_path / "store"))


def broken() -> dict[str, Finding]:
    return {one.name: one for one in examine() if one.status == "broken"}


def test_a_sound_installation() -> None:
    findings = {one.name: one for one in examine()}
    assert broken() == {}
    assert "numba" in findings["versions"].found
    assert "matplotlib" not in findings["versions"].found  # an extra
    assert findings["a plan"].seconds is not None


def test_a_store_that_cannot_be_made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("JOULEPATH_STORE_DIR", str(tmp_path / "file" / "store"))
    assert broken()["store and database"].fix


def test_a_database_of_no_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", "nosuch://host")
    assert "JOULEPATH_DATABASE_URL" in broken()["store and database"].found


def test_a_setting_that_cannot_be_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_PORT", "many")
    found = broken()["settings"]
    assert "JOULEPATH_PORT" in found.found
    assert found.fix == "unset JOULEPATH_PORT"


def test_a_plan_that_fails(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise RuntimeError("no kernel")

    monkeypatch.setattr(doctor, "TRIALS", {"a plan": fail})
    assert broken()["a plan"].found == "RuntimeError: no kernel"
    assert cli.run(["doctor", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["status"] == "broken"
    assert [one["name"] for one in document["checks"] if one["status"] == "broken"] == ["a plan"]


def test_the_command_says_all_is_well(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["doctor"]) == 0
    assert "what would help" in capsys.readouterr().out
