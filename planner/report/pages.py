"""Pages, cards and single pictures out of the views of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from planner.errors import RequestError
from planner.report.markup import STYLES, asset, document, write
from planner.report.standalone import Figure
from planner.report.view import View


def write_report(
    result: Any | Sequence[Any] | Mapping[str, Any], path: str | Path, title: str = ""
) -> None:
    """Write a self-contained HTML page.

    Args:
        result: what to show. Several answers show in order; a mapping gives each a heading.
        path: of the page; its folder is made.
        title: of the page; by default that of the first result.

    Raises:
        RequestError: something given cannot be shown.
    """
    if isinstance(result, Mapping):
        views = [_view(one, heading) for heading, one in result.items()]
    elif isinstance(result, Sequence) and not isinstance(result, str):
        views = [_view(one) for one in result]
    else:
        views = [_view(result)]
    body = "".join(section for view in views for section in view.sections)
    script = next((view.script for view in views if view.script), "")
    write(document(title or next((v.title for v in views), ""), body, script=script), path)


def card(result: Any) -> str:
    """HTML for notebooks: the answer and the most telling pictures."""
    content = _view(result).card
    return f"<div class='joulepath card'><style>{asset(*STYLES)}</style>{content}</div>"


def figure_names(result: Any) -> tuple[str, ...]:
    """Names of the pictures that a result has."""
    return tuple(_view(result).pictures)


def figure(result: Any, name: str) -> Figure:
    """One picture of a result.

    Raises:
        RequestError: the result has no such picture.
    """
    view = _view(result)
    if name not in view.pictures:
        accepted = ", ".join(view.pictures) or f"none: {view.absent}"
        raise RequestError("figure", "no such picture", value=name, accepted=accepted)
    return Figure.of(name, view.pictures[name], view.legends.get(name, {}))


def _view(result: Any, heading: str = "") -> View:
    # By name: to load the class of another kind of result would compile kernels for nothing.
    kind = type(result).__name__
    if kind == "Answer":
        from planner.report.routes import answer_view

        return answer_view(result, heading)
    if kind == "Front":
        from planner.report.routes import front_view

        return front_view(result)
    if kind == "Matrix":
        from planner.report.routes import matrix_view

        return matrix_view(result)
    if kind == "Reach":
        from planner.report.routes import reach_view

        return reach_view(result)
    if kind == "PlannerComparison":
        from planner.report.routes import planner_view

        return planner_view(result)
    if kind in ("Adoption", "Comparison", "Diagnosis", "PowerModel"):
        from planner.report.workbench import workbench_view

        return workbench_view(result)
    raise RequestError(
        "result",
        "cannot be shown",
        value=kind,
        accepted="an Answer, Front, Matrix, Reach, Comparison, Diagnosis, Adoption or PowerModel",
    )
