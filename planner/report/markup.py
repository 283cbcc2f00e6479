"""Pieces of a page: text from outside made harmless, tables, lists, sections, the document itself.

    document("Title", section("Where the model fails", table("Regimes", heads, rows)))

What is not ``Markup`` yet is escaped. Pages are well-formed XML too, so that any parser reads them.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path

# What XML cannot hold: control characters, halves of surrogate pairs, the two non-characters.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff\ufffe\uffff]")


STYLES = ("charts.css", "card.css")
"""Style sheets of what may stand in other people's pages too; their rules are all for our own."""


class Markup(str):
    """Text that is HTML already."""

    __slots__ = ()


def plain(value: object) -> Markup:
    """Any text as HTML that shows exactly this text."""
    if isinstance(value, Markup):
        return value
    return Markup(html.escape(_UNPRINTABLE.sub("\ufffd", str(value))))


def table(
    caption: str,
    heads: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    words: Iterable[int] = (),
    strong: Iterable[int] = (),
) -> Markup:
    """A table whose first column names the rows.

    Args:
        caption: what it shows; "" for none.
        heads: of the columns.
        rows: cells, escaped unless Markup.
        words: numbers of the columns that hold words rather than figures.
        strong: numbers of the rows to be emphasised.
    """
    wordy, emphasised, emphasis = set(words), set(strong), " class='strong'"
    kinds = [" class='words'" if k in wordy else "" for k in range(len(heads))]
    head = "".join(f"<th scope='col'{kinds[k]}>{plain(h)}</th>" for k, h in enumerate(heads))
    body = "".join(
        f"<tr{emphasis if number in emphasised else ''}>"
        f"<th scope='row'{kinds[0]}>{plain(row[0])}</th>"
        + "".join(f"<td{kinds[k]}>{plain(row[k])}</td>" for k in range(1, len(row)))
        + "</tr>"
        for number, row in enumerate(rows)
    )
    told = f"<caption>{plain(caption)}</caption>" if caption else ""
    return Markup(
        # Wide tables scroll by themselves; the keyboard reaches them.
        f"<div class='wide' tabindex='0'><table>{told}<thead><tr>{head}</tr></thead>"
        f"<tbody>{body}</tbody></table></div>"
    )


def bullets(items: Iterable[object]) -> Markup:
    """A list; nothing when there are no items."""
    entries = "".join(f"<li>{plain(item)}</li>" for item in items)
    return Markup(f"<ul>{entries}</ul>" if entries else "")


def paragraph(text: object, kind: str = "") -> Markup:
    """A paragraph; ``kind`` is a class of the style sheet."""
    return Markup(f"<p class='{kind}'>{plain(text)}</p>" if kind else f"<p>{plain(text)}</p>")


def figure(drawing: str, caption: object = "", kind: str = "") -> Markup:
    """A drawing with its caption; nothing when there is no drawing."""
    if not drawing:
        return Markup("")
    below = f"<figcaption>{plain(caption)}</figcaption>" if caption else ""
    return Markup(f"<figure class='{kind}'>{drawing}{below}</figure>")


def folded(summary: str, *parts: str) -> Markup:
    """What only some want to see; nothing when there is nothing."""
    content = "".join(parts)
    return Markup(
        f"<details><summary>{plain(summary)}</summary>{content}</details>" * bool(content)
    )


def section(heading: str, *parts: str) -> Markup:
    """A part of a page, with a heading or without; nothing when it would be empty."""
    content = "".join(parts)
    told = f"<h2>{plain(heading)}</h2>" if heading else ""
    return Markup(f"<section>{told}{content}</section>" if content else "")


def asset(*names: str) -> str:
    """Style sheets and scripts of this package, one after the other."""
    here = files("planner.report")
    return "".join((here / name).read_text("utf-8") for name in names)


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
