"""Results show themselves through whatever renderer the public face registers, loaded late."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from planner import report, shown


class Recorder:
    """A renderer that tells what it was asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple[object, ...]] = []

    def figure(self, result: object, name: str) -> object:
        self.asked.append(("figure", result, name))
        return name

    def figure_names(self, result: object) -> tuple[str, ...]:
        return ("one",)

    def write_report(self, result: object, path: Path, title: str = "") -> None:
        self.asked.append(("write_report", result, path, title))

    def card(self, result: object) -> str:
        return "<p>card</p>"


@pytest.fixture
def recorder() -> Iterator[Recorder]:
    """Renders all results of a test; afterwards the report does again, as the face has it."""
    recorder = Recorder()
    shown.register(lambda: recorder)  # type: ignore[arg-type, return-value]
    yield recorder
    shown.register(lambda: report)


def test_a_result_asks_the_registered_renderer(recorder: Recorder) -> None:
    result = shown.Shown()
    assert result.figure("one") == "one"
    assert result.figures() == ("one",)
    assert result._repr_html_() == "<p>card</p>"
    result.write_report("page.html", "title")
    assert recorder.asked == [
        ("figure", result, "one"),
        ("write_report", result, "page.html", "title"),
    ]


def test_without_a_renderer_nothing_is_shown() -> None:
    script = (
        "from importlib import reload\n"
        "from planner import shown\n"
        "reload(shown)\n"  # as it is before the face registers the report
        "try:\n"
        "    shown.Shown().figures()\n"
        "except RuntimeError as error:\n"
        "    assert 'no renderer' in str(error), error\n"
        "else:\n"
        "    raise SystemExit('shown')\n"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


def test_a_submodule_alone_has_a_renderer_and_loads_it_late() -> None:
    script = (
        "import sys\n"
        "from planner.shown import Shown\n"
        "assert 'planner.report' not in sys.modules\n"
        "try:\n"
        "    Shown().figures()\n"
        "except Exception as error:\n"
        "    assert 'cannot be shown' in str(error), error\n"
        "assert 'planner.report' in sys.modules\n"
        "assert 'numba' not in sys.modules\n"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
