"""Pieces of a page: text from outside made harmless, tables, lists, sections, the document itself.

    document("Title", section("Where the model fails", table("Regimes", heads, rows)))

What is not ``Markup`` yet is escaped. Pages are well-formed XML too, so that any parser reads them.
"""

from __future__ import annotations

import html
import re
from collections.abc import Collection, Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

# What XML cannot hold: control characters, halves of surrogate pairs, the two non-characters.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff\ufffe\uffff]")


STYLES = ("charts.css", "card.css")
"""Style sheets of what may stand in other people's pages too; their rules are all for our own."""


Attributes = dict[str, Any]
"""Of an element, by name."""


class Markup(str):
    """Text that is HTML already."""

    __slots__ = ()


def plain(value: object) -> Markup:
    """Any text as HTML that shows exactly this text."""
    if isinstance(value, Markup):
        return value
    return Markup(html.escape(_UNPRINTABLE.sub("\ufffd", str(value))))


def element(
    name: str, *content: object, kind: str = "", tooltip: str = "", **attributes: Any
) -> Markup:
    """An element of HTML or SVG.

    Args:
        name: of the element.
        content: escaped unless Markup.
        kind: its class in the style sheet.
        tooltip: words under the pointer, for SVG.
        attributes: "_" stands for "-"; numbers keep two decimals; what is None or "" is left out.
    """
    given = {"class": kind, **attributes}
    written = "".join(
        f' {key.replace("_", "-")}="{plain(_number(value))}"'
        for key, value in given.items()
        if value is not None and value != ""
    )
    inside = [element("title", tooltip)] if tooltip else []
    return Markup(f"<{name}{written}>{joined(*inside, *content)}</{name}>")


def _number(value: object) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def joined(*parts: object) -> Markup:
    """Parts one after the other."""
    return Markup("".join(map(plain, parts)))


def table(
    caption: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[object]],
    *,
    foot: Sequence[object] = (),
    words: Collection[int] = (),
    strong: Collection[int] = (),
    kind: str = "",
) -> Markup:
    """A table whose first column names the rows; nothing when there are no rows.

    Args:
        caption: what it shows; "" for none.
        heads: of the columns.
        rows: cells, escaped unless Markup.
        foot: cells of a row of sums; empty for none.
        words: numbers of the columns that hold words rather than figures.
        strong: numbers of the rows to be emphasised.
        kind: class of the style sheet.
    """
    if not rows:
        return Markup("")

    def row(cells: Sequence[object], scope: str = "", kind: str = "") -> Markup:
        return element("tr", *(cell(k, cells[k], scope) for k in range(len(cells))), kind=kind)

    def cell(column: int, content: object, scope: str) -> Markup:
        scope = scope or ("" if column else "row")
        wordy = "words" if column in words else ""
        return element("th" if scope else "td", content, scope=scope, kind=wordy)

    body = (row(cells, kind="strong" if k in strong else "") for k, cells in enumerate(rows))
    made = element(
        "table",
        element("caption", caption) if caption else "",
        element("thead", row(heads, "col")),
        element("tbody", *body),
        element("tfoot", row(foot)) if foot else "",
        kind=kind,
    )
    # Wide tables scroll by themselves; the keyboard reaches them.
    return element("div", made, kind="wide", tabindex=0)


def bullets(items: Iterable[object], kind: str = "") -> Markup:
    """A list; nothing when there are no items."""
    entries = [element("li", item) for item in items]
    return element("ul", *entries, kind=kind) if entries else Markup("")


def paragraph(text: object, kind: str = "") -> Markup:
    """A paragraph; ``kind`` is a class of the style sheet."""
    return element("p", text, kind=kind)


def figure(drawing: str, caption: object = "", kind: str = "") -> Markup:
    """A drawing with its caption; nothing when there is no drawing."""
    below = element("figcaption", caption) if caption else ""
    return element("figure", Markup(drawing), below, kind=kind) if drawing else Markup("")


def pair(left: str, right: str) -> Markup:
    """Two pieces beside each other where there is room."""
    return element("div", Markup(left), Markup(right), kind="pair")


def dot(colour: str) -> Markup:
    """A dot of a colour, for legends and tables.

    No style attribute: strict content policies forbid them.
    """
    square = element("rect", width=1, height=1, fill=colour)
    return element("svg", square, kind="dot", viewBox="0 0 1 1", aria_hidden="true")


def folded(summary: str, *parts: str) -> Markup:
    """What only some want to see; nothing when there is nothing."""
    content = Markup("".join(parts))
    return element("details", element("summary", summary), content) if content else content


def section(heading: str, *parts: str, kind: str = "") -> Markup:
    """A part of a page, with a heading or without; nothing when it would be empty."""
    content = Markup("".join(parts))
    title = element("h2", heading) if heading else ""
    return element("section", title, content, kind=kind) if content else content


def asset(*names: str) -> Markup:
    """Style sheets and scripts of this package, one after the other."""
    here = files("planner.report")
    return Markup("".join((here / name).read_text("utf-8") for name in names))


def document(title: str, body: str, *, script: str = "") -> str:
    """A whole page that needs nothing else.

    Args:
        title: of the page.
        body: sections.
        script: a file of this package to run at the end.
    """
    # Hidden from XML, where "<" opens a tag in a script too.
    end = f"<script>//<![CDATA[\n{asset(script)}//]]></script>" if script else ""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"/>'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>'
        f"<title>{plain(title)}</title><style>{asset(*STYLES, 'page.css')}</style></head>"
        f'<body class="joulepath"><header><h1>{plain(title)}</h1></header><main>{body}</main>'
        f"{end}</body></html>\n"
    )


def write(page: str, path: str | Path) -> None:
    """Write a page as UTF-8; its folder is made."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page, encoding="utf-8")
