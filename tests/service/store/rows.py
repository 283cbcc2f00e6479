"""Rows for a store: a log as it was read, and what a job left."""

from __future__ import annotations

from typing import Any

from service.store import log_id

PROBLEM = {"type": "urn:joulepath:problem:worker-lost", "title": "x", "status": 500, "detail": "y"}
UPLOAD = {
    "log": log_id("ab" * 32, None),
    "name": "drive.csv",
    "sha256": "ab" * 32,
    "mapped": False,
    "bytes": 10,
}
READ: dict[str, Any] = {"rows": 4, "runs": 1, "report": [], "derived": [], "assumed": []}


def done(_: Any) -> dict[str, Any]:
    return {"rmse_w": 2.0}
