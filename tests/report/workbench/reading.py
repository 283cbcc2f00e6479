"""Pages as trees of elements."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

SVG = "{http://www.w3.org/2000/svg}"


def tree(page: str) -> ElementTree.Element:
    return ElementTree.fromstring(page.replace("<!DOCTYPE html>", "", 1))


def words(element: ElementTree.Element) -> str:
    return " ".join("".join(element.itertext()).split())


def rows_of(page: str, heading: str) -> list[list[str]]:
    """Cells of the tables in the section with a heading."""
    found = [s for s in tree(page).iter("section") if s.findtext("h2") == heading]
    assert found, heading
    return [[words(cell) for cell in row] for row in found[0].iter("tr")]
