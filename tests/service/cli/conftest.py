"""A planner that answers at once."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

import planner
from tests.service.route_documents import answer


class Fake:
    """Stands where the planner would and remembers the request."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.document: dict[str, Any] = answer()
        self.error: BaseException | None = None
        self.request: Any = None
        # Not setattr, which would load the real one to put it back.
        monkeypatch.setitem(vars(planner), "plan_route", self.plan_route)

    def plan_route(self, request: Any, **_: Any) -> Any:
        """Answers with ``document`` or raises ``error``."""
        self.request = request
        if self.error is not None:
            raise self.error
        return SimpleNamespace(to_json=lambda: self.document)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> Fake:
    """A planner that answers at once."""
    return Fake(monkeypatch)
