"""The catalogue is what stands in its folder; a file that lacks something says what."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

LISTING = """
import sys
import planner.power.effects as package
package.__path__.append(sys.argv[1])
from planner.power.catalogue import all_effects
print(" ".join(all_effects()))
"""
HEAD = "from planner.power.effect import Effect, Parameter\n"
BODY = '''
class HumOfTheBus(Effect):
    """Watts that are always there."""

    slug = "hum_of_the_bus"
    title = "hum"
    hum = Parameter(unit="W", default=1.0, null=0.0, bounds=(0.0, 9.0), doc="Any.")

    @staticmethod
    def bus(hum):
        return hum
'''


def listed(folder: Path, text: str) -> subprocess.CompletedProcess[str]:
    """The catalogue of a process in which one more file belongs to it."""
    (folder / "hum_of_the_bus.py").write_text(HEAD + text, encoding="utf-8")
    return subprocess.run(
        [sys.executable, "-c", LISTING, str(folder)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )


def test_a_file_is_found(tmp_path: Path) -> None:
    found = listed(tmp_path, BODY)
    assert "hum_of_the_bus" in found.stdout.split(), found.stderr


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('slug = "hum_of_the_bus"', 'slug = "hum"', "one class of Effect with slug = 'hum_of_the"),
        (' slug = "hum_of_the_bus"\n', "\n", "HumOfTheBus.slug: missing"),
        (' title = "hum"\n', "\n", "HumOfTheBus.title: missing"),
        ("default=1.0", "default=0.0", "default is its null value; give one hidden_at"),
        ("null=0.0, ", "", "needs a null value"),
        ("class HumOfTheBus(Effect)", "class HumOfTheBus", "one class of Effect with slug"),
        ("def bus(hum)", "def buss(hum)", "HumOfTheBus.buss: no such hook"),
        ("    @staticmethod\n    def bus(hum):\n        return hum\n", "", "no hook; there are"),
        ('    title = "hum"\n', '    title = "hum"\n    base = True\n', "base: only electronics"),
        ("return hum", "return abs(hum)", r"HumOfTheBus.bus, line \d+: .*absolute\(x\)"),
    ],
)
def test_what_a_file_lacks_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in BODY
    found = listed(tmp_path, BODY.replace(old, new))
    assert found.returncode != 0
    assert re.search(words, found.stderr), found.stderr
