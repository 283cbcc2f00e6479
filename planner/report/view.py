"""A result as it is shown: its pictures, the sections of its page, its card for notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class View:
    """What is shown of one result.

    Attributes:
        title: of the page.
        pictures: name → drawing.
        sections: of the page, as HTML.
        card: HTML for notebooks.
        legends: name of a picture → class of the style sheet → words, for a picture by itself.
        absent: why there are no pictures, where there are none.
        script: a file of this package that the page runs; "" for none.
    """

    title: str
    pictures: Mapping[str, str]
    sections: tuple[str, ...]
    card: str
    legends: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    absent: str = ""
    script: str = ""
