"""The commands for many routes at once: ``matrix``, ``reach`` and ``front``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from planner.search.situation_request import SituationRequest
from service.terminal import Json, Verbose, interruptible, progress_bar, show, tell_written

Asked = TypeVar("Asked", bound=SituationRequest)

RequestFile = Annotated[
    Path, typer.Argument(metavar="REQUEST.json", help="The request; - reads it from stdin.")
]
Out = Annotated[Path | None, typer.Option(help="Write the answer to this JSON file.")]


def matrix(
    request: RequestFile, out: Out = None, json_: Json = False, verbose: Verbose = False
) -> None:
    """Energies from each of some places to each of others."""
    from planner import energy_matrix
    from planner.search.request import MatrixRequest

    asked = read_request(request, MatrixRequest)
    with interruptible() as cancelled, progress_bar() as progress:
        found = energy_matrix(asked, progress=progress, cancelled=cancelled)
    _tell(found.to_json(), out, json_, "matrix")


def reach(
    request: RequestFile, out: Out = None, json_: Json = False, verbose: Verbose = False
) -> None:
    """How far an energy takes the robot, there or there and back."""
    from planner import reachable_area
    from planner.search.request import ReachRequest

    asked = read_request(request, ReachRequest)
    with interruptible() as cancelled, progress_bar() as progress:
        found = reachable_area(asked, progress=progress, cancelled=cancelled)
    _tell(found.to_json(), out, json_, "reach")


def front(
    request: RequestFile, out: Out = None, json_: Json = False, verbose: Verbose = False
) -> None:
    """What a second costs: routes from the fastest to that of least energy."""
    from planner import energy_time_front
    from planner.search.request import FrontRequest

    asked = read_request(request, FrontRequest)
    with interruptible() as cancelled, progress_bar() as progress:
        found = energy_time_front(asked, progress=progress, cancelled=cancelled)
    _tell(found.to_json(), out, json_, "front")


VERBS = (matrix, reach, front)


def _tell(document: dict[str, Any], out: Path | None, as_json: bool, verb: str) -> None:
    from service import documents, tables

    if out is not None:
        documents.write_whole(out, documents.strict(document) + "\n")
    if as_json:
        typer.echo(documents.strict(document))
        return
    shown = {"matrix": tables.matrix, "reach": tables.reach, "front": tables.front}[verb]
    show(shown(document))
    tell_written(out, None)


def read_request(
    path: Path, kind: type[Asked], overrides: Mapping[str, Any] | None = None
) -> Asked:
    """A request out of a file, or from stdin where the path is ``-``.

    Raises:
        RequestError: the file cannot be read, or the first field that cannot be used.
    """
    if str(path) == "-":
        return kind.from_text(typer.get_binary_stream("stdin").read(), overrides)
    return kind.from_file(path, overrides)
