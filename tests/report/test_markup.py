"""Text from outside stays text, in every piece of a page."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from planner.report.markup import (
    Markup,
    bullets,
    document,
    figure,
    folded,
    paragraph,
    plain,
    section,
    table,
    write,
)


def test_text_from_outside_stays_text() -> None:
    assert plain("<b>\x00\ud800</b>") == "&lt;b&gt;\ufffd\ufffd&lt;/b&gt;"
    assert plain(Markup("<b/>")) == "<b/>"
    assert "&lt;i&gt;" in table("<i>", ["<i>"] * 2, [["<i>"] * 2])
    assert "<i>" not in table("<i>", ["<i>"] * 2, [["<i>"] * 2])


def test_every_piece_escapes_what_is_not_markup_yet() -> None:
    for piece in (
        paragraph("<i>"),
        bullets(["<i>"]),
        section("<i>", Markup("<p>x</p>")),
        folded("<i>", Markup("<p>x</p>")),
        figure("<svg/>", "<i>"),
    ):
        assert "&lt;i&gt;" in piece
        assert "<i>" not in piece
        ElementTree.fromstring(piece)
        # A piece is markup: put into another one, it is not escaped again.
        assert plain(piece) == piece


def test_what_would_be_empty_is_left_out() -> None:
    assert bullets([]) == figure("", "caption") == folded("more") == section("Heading") == ""


def test_a_table_names_its_rows_and_marks_the_strong_ones() -> None:
    made = table("Errors", ["run", "W"], [["a", "1"], ["b", "2"]], words=[0], strong=[1])
    rows = list(ElementTree.fromstring(made).iter("tr"))
    assert [[cell.text for cell in row] for row in rows] == [["run", "W"], ["a", "1"], ["b", "2"]]
    assert [row.attrib.get("class") for row in rows] == [None, None, "strong"]
    assert all(row[0].tag == "th" and row[1].tag != row[0].tag for row in rows[1:])
    assert [cell.attrib.get("class") for cell in rows[1]] == ["words", None]


def test_a_document_is_well_formed_and_stands_alone(tmp_path: Path) -> None:
    page = document("A & B <c>", paragraph("1 < 2"))
    root = ElementTree.fromstring(page.replace("<!DOCTYPE html>", "", 1))
    assert root.findtext("head/title") == root.findtext("body/header/h1") == "A & B <c>"
    assert root.findtext("body/main/p") == "1 < 2"
    assert not [e for e in root.iter() if {"src", "href"} & set(e.attrib)]
    write(page, tmp_path / "new" / "page.html")
    assert (tmp_path / "new" / "page.html").read_text(encoding="utf-8") == page
