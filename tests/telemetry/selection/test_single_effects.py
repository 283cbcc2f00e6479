"""Which of the effects that were fitted alone explain a log as well as the best one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from planner.telemetry.selection.single_effects import EQUAL_RATIO, Tried, with_equals


def tried(name: str, error_w: float, *, supported: bool = True) -> Tried:
    """An effect with its held-out error; what else it has no test looks at."""
    unused: Any = SimpleNamespace(name=name)
    return Tried(unused, unused, unused, np.zeros(0), error_w, supported)


def test_effects_with_the_error_of_the_best_one_are_its_equals():
    near, far = 0.999 * EQUAL_RATIO, 1.001 * EQUAL_RATIO
    best, *others = with_equals([tried("a", 1.0), tried("b", near), tried("c", far)])
    assert best.name == "a"
    assert best.equals == ("b",)
    assert all(other.equals == () for other in others)


def test_nothing_equals_what_held_out_runs_do_not_support():
    assert with_equals([]) == ()
    alone = with_equals([tried("a", 1.0), tried("b", 1.0, supported=False)])
    assert alone[0].equals == ()
    assert with_equals([tried("a", 1.0, supported=False)])[0].equals == ()
