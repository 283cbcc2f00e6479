"""Settings come from the environment, within bounds."""

from __future__ import annotations

import os

import pytest
from pydantic import ValidationError

from planner.errors import InputError
from service.cli import run
from service.settings import Settings, read_settings


def test_keys_stand_between_commas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_API_KEYS", " key-1, key-2,,")
    assert Settings().keys == ("key-1", "key-2")
    assert "key-1" not in repr(Settings())


def test_all_workers_together_keep_at_most_half_of_the_memory() -> None:
    """Within the bounds of 512 and 4096 MiB each."""
    machine_mb = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**20
    kept = Settings().worker_memory_mb
    assert kept in (512, 4096) or kept * (os.cpu_count() or 1) <= machine_mb / 2


@pytest.mark.parametrize(
    ("name", "value"),
    [("WORKER_MEMORY_MB", "10"), ("WORKER_AGE_S", "-1"), ("WORKERS", "0"), ("API_KEYS", "é")],
)
def test_what_is_out_of_bounds_is_refused(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(f"JOULEPATH_{name}", value)
    with pytest.raises(ValidationError):
        Settings()


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("WORKERS", "x", "JOULEPATH_WORKERS: is not a whole number (got 'x'); accepted: processes"),
        ("PORT", "70000", "JOULEPATH_PORT: is too large (got '70000'); accepted: port to listen"),
        (
            "LOG_LEVEL",
            "loud",
            "JOULEPATH_LOG_LEVEL: is none of the choices (got 'loud'); ",
        ),
        ("DATA_DIR", "/none", "JOULEPATH_DATA_DIR: is not a folder (got '/none'); accepted: a "),
        ("API_KEYS", "sécret", "JOULEPATH_API_KEYS: cannot be used; accepted: keys that open"),
    ],
)
def test_a_wrong_setting_is_one_sentence_of_serve(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    value: str,
    sentence: str,
) -> None:
    monkeypatch.setenv(f"JOULEPATH_{name}", value)
    assert run(["serve"]) == 2
    assert sentence in capsys.readouterr().err
    with pytest.raises(InputError) as refusal:
        read_settings()
    assert "sécret" not in str(refusal.value)
