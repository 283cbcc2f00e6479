"""Pages, cards and single pictures out of the views of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from planner.errors import RequestError
from planner.report.markup import STYLES, Markup, asset, document, element, write
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
        headings, results = [*result], [*result.values()]
    elif isinstance(result, Sequence) and not isinstance(result, str):
        headings, results = [], [*result]
    else:
        headings, results = [""], [result]
    views = [_view(one) for one in results]
    titles = [view.title for view in views]
    parts = []
    for heading, view in zip(headings or titles, views, strict=True):
        parts += [element("h2", heading) if heading else "", *view.sections]
    script = next((view.script for view in views if view.script), "")
    write(document(title or next(iter(titles), ""), "".join(parts), script=script), path)


def card(result: Any) -> str:
    """HTML for notebooks: the answer and the most telling pictures."""
    styles = element("style", asset(*STYLES))
    return element("div", styles, Markup(_view(result).card), kind="joulepath card")


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


# By name: to load the class of another kind of result would compile kernels for nothing.
_ROUTES = ("Answer", "Front", "Matrix", "Reach", "PlannerComparison")
_WORKBENCH = ("Comparison", "Diagnosis", "Adoption", "PowerModel")


def _view(result: Any) -> View:
    kind = type(result).__name__
    if kind in _ROUTES:
        from planner.report import routes

        return routes.VIEWS[kind](result)
    if kind in _WORKBENCH:
        from planner.report import workbench

        return workbench.VIEWS[kind](result)
    accepted = f"one of: {', '.join([*_ROUTES, *_WORKBENCH])}"
    raise RequestError("result", "cannot be shown", value=kind, accepted=accepted)
