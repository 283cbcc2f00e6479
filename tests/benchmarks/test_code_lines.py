"""Only lines with code on them count."""

from __future__ import annotations

import pytest

from tests.benchmarks.code_lines import python_lines, script_lines


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ('"""Head."""\n\n# why\nA = 1\n"""What A is."""\n', 1),
        ('def f():\n    """Says.\n\n    More.\n    """\n    return (\n        1\n    )\n', 4),
        ('A = """\none\ntwo\n"""\n', 4),
        ("A = 1  # m\n", 1),
    ],
)
def test_python(text: str, lines: int) -> None:
    assert python_lines(text) == lines


def test_javascript() -> None:
    assert script_lines("// a\n\n/* b\n c */\nlet d = 1 // e\n") == 1
