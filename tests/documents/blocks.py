"""Code blocks of the documents."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    "README.md",
    "CONTRIBUTING.md",
    *sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md")),
]


@dataclass(frozen=True)
class Block:
    """A code block.

    Attributes:
        page: its file, from the root of the repository.
        line: of its opening fence.
        language: what its fence says; empty without a fence or a word.
        title: name of the file that it shows, from ``title="…"``; empty without.
        text: its lines.
    """

    page: str
    line: int
    language: str
    title: str
    text: str

    @property
    def place(self) -> str:
        """Page and line, for messages."""
        return f"{self.page}:{self.line}"


def blocks_of(page: str) -> list[Block]:
    """All code blocks of a page, in order."""
    tokens = MarkdownIt().parse((ROOT / page).read_text("utf-8"))
    found = []
    for token in tokens:
        if token.type in ("fence", "code_block"):
            assert token.map is not None
            title = re.search(r'title="([^"]+)"', token.info)
            language = token.info.split()[0] if token.info else ""
            found.append(
                Block(page, token.map[0] + 1, language, title[1] if title else "", token.content)
            )
    return found
