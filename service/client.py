"""A client for the service; needs httpx and nothing of the planner.

with JoulepathClient("http://127.0.0.1:8000") as client:
    answer = client.plan(map="warehouse", start={"x": 1.5, "y": 2}, goal={"x": 27, "y": 17})
    print(answer["routes"][0]["energy_j"])
"""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Any, Self

import httpx


class ServiceProblem(Exception):
    """The service answered with a problem document (RFC 9457).

    Attributes:
        problem: the document: type, title, status, detail and, where it applies, field, accepted.
    """

    def __init__(self, problem: Mapping[str, Any]) -> None:
        self.problem = dict(problem)
        super().__init__(str(self.problem.get("detail") or self.problem.get("title")))

    @property
    def status(self) -> int:
        """HTTP status."""
        return int(self.problem.get("status", 0))

    @property
    def field(self) -> str | None:
        """Field of the request that could not be used."""
        return self.problem.get("field")


class JoulepathClient:
    """Calls one service.

    Args:
        base_url: such as http://127.0.0.1:8000.
        timeout: seconds to wait for an answer.
        transport: how requests travel; for tests and special networks.
    """

    def __init__(
        self,
        base_url: str,
        *,
        timeout: float = 180.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        self._http = httpx.Client(base_url=base_url, timeout=timeout, transport=transport)

    def plan(self, request: Mapping[str, Any] | None = None, **fields: Any) -> dict[str, Any]:
        """Plan a route.

        Args:
            request: REQUEST.json as a mapping.
            fields: fields of the request, over those of ``request``.

        Returns:
            ROUTE.json; its ``status`` may be "no_route".

        Raises:
            ServiceProblem: the service could not use or not answer the request.
            httpx.HTTPError: the service could not be reached.
        """
        response = self._http.post("/v1/routes", json={**(request or {}), **fields})
        result: dict[str, Any] = _document(response)
        return result

    def maps(self) -> list[dict[str, Any]]:
        """Maps that requests may name."""
        return self._list("/v1/maps")

    def vehicles(self) -> list[dict[str, Any]]:
        """Vehicles that requests may name."""
        return self._list("/v1/vehicles")

    def effects(self) -> list[dict[str, Any]]:
        """Physical effects that a power model can hold."""
        return self._list("/v1/effects")

    def health(self) -> dict[str, Any]:
        """Version of the service and state of its workers."""
        result: dict[str, Any] = _document(self._http.get("/healthz"))
        return result

    def _list(self, path: str) -> list[dict[str, Any]]:
        result: list[dict[str, Any]] = _document(self._http.get(path))
        return result

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _document(response: httpx.Response) -> Any:
    if response.is_success:
        return response.json()
    try:
        problem = response.json()
    except ValueError:
        problem = None
    if not isinstance(problem, dict):
        problem = {"title": response.reason_phrase, "status": response.status_code}
    raise ServiceProblem({"status": response.status_code, **problem})
