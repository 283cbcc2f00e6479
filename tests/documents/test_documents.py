"""Every code block and command of the documents runs, page by page, as its reader would run it.

A fence states what a block is:

- ``python``, ``sh``: run; a page's programs share their names and its folder.
- ``output``: what the block before it prints, numbers to within 5 %.
- ``json``, ``toml``, ``yaml``: requests, vehicles, maps and mappings; they must be accepted.
- ``text``: formulas and drawings; the commands and options of a usage exist.

``title="FILE"`` names the file that a block shows. What the reader brings along, such as a log, is
in ``given.py``; commands that are not run are in ``running.UNTRIED``, with reasons.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.documents.blocks import PAGES, blocks_of
from tests.documents.running import UNTRIED, Reader, commands, served

NIGHTLY = {
    f"docs/{name}.md"
    for name in (
        *("cli", "diagnosis", "guide", "http", "ompl", "python"),
        *("tutorials/my-building", "tutorials/my-effect", "tutorials/my-log"),
    )
}
"""Pages that take many seconds of CPU time; README.md has the most important of their commands."""
LANGUAGES = {"python", "sh", "output", "json", "toml", "yaml", "text"}


def _pages() -> list[object]:
    return [
        pytest.param(page, marks=pytest.mark.nightly if page in NIGHTLY else ())
        for page in PAGES
        if blocks_of(page)
    ]


def test_every_fence_says_what_it_is() -> None:
    blocks = [block for page in PAGES for block in blocks_of(page)]
    assert [block.place for block in blocks if block.language not in LANGUAGES] == []


def test_no_reason_is_kept_for_a_command_that_is_gone() -> None:
    blocks = [block for page in PAGES for block in blocks_of(page) if block.language == "sh"]
    shown = [command for block in blocks for command in commands(block.text)]
    assert [p for p in UNTRIED if not any(re.match(p, command) for command in shown)] == []


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Of a service."""
    with served(tmp_path_factory.mktemp("store")) as found:
        yield found


@pytest.mark.parametrize("page", _pages())
def test_every_block_of_the_page_runs(
    page: str, address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    reader = Reader(tmp_path, address)
    for block in blocks_of(page):
        try:
            reader.read(block)
        except Exception as error:
            error.add_note(f"in {block.place}")
            raise
