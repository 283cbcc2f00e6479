"""A client for the service; needs httpx and nothing of the planner.

with JoulepathClient("http://127.0.0.1:8000") as client:
    answer = client.plan(map="warehouse", start={"x": 1.5, "y": 2}, goal={"x": 27, "y": 17})
    print(answer["routes"][0]["energy_j"])
    log = client.upload_log("drive.csv")
    print(client.diagnose(log["id"], vehicle="minibalance")["sentence"])
    adopted = client.adopt("diagnosed", log["id"], vehicle="minibalance")
    client.plan(map="warehouse", model=adopted["model_id"], start=…, goal=…)
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Self

import httpx

Progress = Callable[[float, str], None]

_PAUSE_S = 0.3
"""Between two questions how far a job is."""
_CANCELLED = {"title": "Conflict", "status": 409, "detail": "the job was cancelled"}


class ServiceProblem(Exception):
    """A problem document (RFC 9457) from the service.

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
        api_key: of a service that asks for one.
        timeout: seconds to wait for an answer.
        transport: how requests travel; for tests and special networks.
    """

    def __init__(
        self,
        base_url: str,
        *,
        api_key: str | None = None,
        timeout: float = 180.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        headers = {} if api_key is None else {"Authorization": f"Bearer {api_key}"}
        self._http = httpx.Client(
            base_url=base_url, headers=headers, timeout=timeout, transport=transport
        )

    def plan(self, request: Mapping[str, Any] | None = None, **fields: Any) -> dict[str, Any]:
        """Plan a route.

        Args:
            request: REQUEST.json as a mapping.
            fields: fields of the request, over those of ``request``.

        Returns:
            ROUTE.json; its ``status`` may be "no_route".

        Raises:
            ServiceProblem: the request cannot be used, or the service cannot answer it.
            httpx.HTTPError: the service cannot be reached.
        """
        return self._one("POST", "/v1/routes", {**(request or {}), **fields})

    def front(self, request: Mapping[str, Any] | None = None, **fields: Any) -> dict[str, Any]:
        """Pareto front of duration and energy; arguments as for ``plan``.

        Returns:
            a document with ``points``, each a route as in ROUTE.json with its ``price_w``.
        """
        return self._one("POST", "/v1/fronts", {**(request or {}), **fields})

    def upload_log(
        self,
        log: str | Path | bytes,
        *,
        mapping: str | Path | bytes | None = None,
        name: str | None = None,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Upload a log; returns when the service has read it.

        Args:
            log: path of a CSV or Parquet file, or its content.
            mapping: path of a mapping file, or its content.
            name: what to call the log; the file's name when left out.
            progress: called with the share done and a sentence while the service reads.

        Returns:
            the log with ``id``, ``rows``, ``report``, ``derived``, ``assumed``.

        Raises:
            ServiceProblem: the log cannot be used; its ``detail`` says why.
        """
        with ExitStack() as stack:

            def part(given: str | Path | bytes, name: str | None) -> tuple[str, Any]:
                if isinstance(given, bytes):
                    return name or "log", given
                return name or Path(given).name, stack.enter_context(Path(given).open("rb"))

            files = {"log": part(log, name)}
            if mapping is not None:
                files["mapping"] = part(mapping, "mapping.toml")
            response = self._http.post("/v1/logs", files=files, params={"wait": 5})
        return self._outcome(response, progress)

    def logs(self) -> list[dict[str, Any]]:
        """Logs that were uploaded, newest first."""
        return self._list("/v1/logs")

    def delete_log(self, log: str) -> None:
        """Remove a log; models adopted from it stay."""
        _document(self._http.delete(f"/v1/logs/{log}"))

    def compare(
        self,
        log: str,
        *,
        vehicle: str | None = None,
        model: str | None = None,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Compare a log's measured power with a model's.

        Args:
            log: id of the log.
            vehicle: start from this vehicle's base model, fitted to the log.
            model: start from this saved model, by its id.
            progress: called with the share done and a sentence.

        Raises:
            ServiceProblem: the request cannot be used, or the job failed or was cancelled.
        """
        return self._verb("compare", progress, log=log, vehicle=vehicle, model=model)

    def diagnose(
        self,
        log: str,
        *,
        vehicle: str | None = None,
        model: str | None = None,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Name the effects missing from a model; arguments as for ``compare``."""
        return self._verb("diagnose", progress, log=log, vehicle=vehicle, model=model)

    def adopt(
        self,
        effects: str | Sequence[str],
        log: str,
        *,
        vehicle: str | None = None,
        model: str | None = None,
        formula: Mapping[str, Any] | None = None,
        progress: Progress | None = None,
    ) -> dict[str, Any]:
        """Add effects to a model; the new version's id is in ``model_id``.

        Args:
            effects: names, or "diagnosed" for everything that the diagnosis selects.
            log, vehicle, model, progress: as for ``compare``.
            formula: definition of a custom effect, adopted under its name.
        """
        named = [effects] if isinstance(effects, str) else list(effects)
        start = {"log": log, "vehicle": vehicle, "model": model}
        definition = None if formula is None else dict(formula)
        return self._verb("adopt", progress, **start, effects=named, formula=definition)

    def models(self) -> list[dict[str, Any]]:
        """Versions of models, newest first."""
        return self._list("/v1/models")

    def model(self, model: str) -> dict[str, Any]:
        """A saved model; written to a file, the command line and Python read it."""
        return self._one("GET", f"/v1/models/{model}")

    def upload_model(self, document: Mapping[str, Any]) -> dict[str, Any]:
        """Upload a saved model; returns its entry in the list of models."""
        return self._one("POST", "/v1/models", dict(document))

    def history(self, model: str) -> list[dict[str, Any]]:
        """Changes of a model, oldest first."""
        return self._list(f"/v1/models/{model}/history")

    def revert(self, model: str, version: int) -> dict[str, Any]:
        """Revert to an earlier version; returns the new one."""
        return self._one("POST", f"/v1/models/{model}/revert", {"version": version})

    def jobs(self) -> list[dict[str, Any]]:
        """The newest jobs, without their results."""
        return self._list("/v1/jobs")

    def job(self, job: str) -> dict[str, Any]:
        """State, progress and result of a job."""
        return self._one("GET", f"/v1/jobs/{job}")

    def cancel(self, job: str) -> dict[str, Any]:
        """End a job; returns it."""
        return self._one("DELETE", f"/v1/jobs/{job}")

    def wait(self, job: str, progress: Progress | None = None) -> dict[str, Any]:
        """Wait for the result of a job; an interrupt cancels the job.

        Args:
            job: its id.
            progress: called with the share done and a sentence whenever they change.

        Raises:
            ServiceProblem: the job failed or was cancelled.
        """
        reported: tuple[float, str] | None = None
        try:
            while True:
                found = self.job(job)
                now = (found["progress"]["share"], found["progress"]["sentence"])
                if progress is not None and now != reported:
                    progress(*now)
                    reported = now
                match found["state"]:
                    case "done":
                        return dict(found["result"])
                    case "failed":
                        raise ServiceProblem(found["error"])
                    case "cancelled":
                        raise ServiceProblem(_CANCELLED)
                time.sleep(_PAUSE_S)
        except KeyboardInterrupt:
            self.cancel(job)
            raise

    def _verb(self, verb: str, progress: Progress | None, **fields: Any) -> dict[str, Any]:
        asked = {key: value for key, value in fields.items() if value is not None}
        return self._outcome(self._http.post(f"/v1/{verb}", json=asked), progress)

    def _outcome(self, response: httpx.Response, progress: Progress | None) -> dict[str, Any]:
        document: dict[str, Any] = _document(response)
        if response.status_code == httpx.codes.ACCEPTED:
            return self.wait(document["id"], progress)
        return document

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
        return self._one("GET", "/healthz")

    def _one(self, method: str, path: str, body: Any = None) -> dict[str, Any]:
        result: dict[str, Any] = _document(self._http.request(method, path, json=body))
        return result

    def _list(self, path: str) -> list[dict[str, Any]]:
        result: list[dict[str, Any]] = _document(self._http.get(path))
        return result

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _document(response: httpx.Response) -> Any:
    if response.is_success:
        return response.json() if response.content else None
    problem: Any = None
    with suppress(ValueError):
        problem = response.json()
    if not isinstance(problem, dict):
        problem = {"title": response.reason_phrase}
    raise ServiceProblem({"status": response.status_code, **problem})
