"""Uploads go to the disk as they come, within bounds."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Any

import httpx
import pytest

from service.settings import Settings
from tests.service.conftest import Http, ScriptedWorkers
from tests.service.http.exchanges import expect_problem
from tests.service.workbench import CSV, Workbench, talk


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

FIELD = b'--b\r\nContent-Disposition: form-data; name="mapping"\r\n\r\n'


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
        (FIELD + b"x" * 70_000 + b"\r\n--b--\r\n", BOUNDARY, 413),
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


def test_a_log_under_another_name_is_told_the_right_one(http: Http, bench: Workbench) -> None:
    """However large it is: the size of the field is not what is wrong."""
    large = PART.replace(b'"log"', b'"file"').replace(b"x\r\n", b"x" * 70_000 + b"\r\n")
    answer = http.post("/v1/logs", content=large + b"--b--\r\n", headers=BOUNDARY)
    detail = expect_problem(answer, 422)["detail"]
    assert "'file'" in detail
    assert "'log'" in detail


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
