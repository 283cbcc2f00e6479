"""The public face: every name is there when it is asked for, and nothing heavy is loaded before."""

from __future__ import annotations

import subprocess
import sys

import pytest

import planner


@pytest.mark.parametrize("name", planner.__all__)
def test_every_name_of_the_face_is_there(name: str) -> None:
    found = getattr(planner, name)
    assert found.__name__ == name
    assert found.__module__.startswith("planner.")


def test_the_face_is_listed_once_and_in_order() -> None:
    assert list(planner.__all__) == sorted(set(planner.__all__))


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'plan_rout'"):
        planner.plan_rout  # noqa: B018


def test_importing_the_package_loads_nothing_heavy() -> None:
    """A command that only lists maps need not wait for numba and OMPL."""
    script = (
        "import sys, planner\n"
        "heavy = ('numba', 'ompl', 'scipy', 'planner.report', 'planner.search', "
        "'planner.telemetry', 'planner.power')\n"
        "assert not [name for name in heavy if name in sys.modules]\n"
        "planner.PlanRequest\n"
        "assert 'planner.search.requests' in sys.modules\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
