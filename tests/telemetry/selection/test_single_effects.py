"""Which of the effects that were fitted alone explain a log as well as the best one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from planner.telemetry.selection.single_effects import EQUAL_SHARE, Tried, with_equals


def tried(name: str, error_w: float, *, supported: bool = True) -> Tried:
    """An effect with its held-out error; what else it has no test looks at."""
    unused: Any = SimpleNamespace(name=name)
    return Tried(unused, unused, unused, np.zeros(0), np.zeros(0), error_w, supported)


def with_error(share: float) -> float:
    """Error of an effect that takes off a share of what is taken off from 2 W to 1 W."""
    return float(np.sqrt(4.0 - 3.0 * share))


def always(*_: Tried) -> bool:
    """Held-out runs support the best one against any other."""
    return True


def test_twins_that_explain_as_much_are_its_equals_and_others_compete():
    near, far = with_error(1.01 * EQUAL_SHARE), with_error(0.99 * EQUAL_SHARE)
    singles = [tried("a", 1.0), tried("twin", near), tried("other", near), tried("c", far)]
    best, *others = with_equals(singles, 2.0, lambda one, other: other.name == "twin", always)
    assert best.name == "a"
    assert best.equals == ("twin",)
    assert best.competing == ("other",)
    assert all(other.equals == other.competing == () for other in others)


def test_nothing_equals_what_held_out_runs_do_not_support():
    assert with_equals([], 2.0, always, always) == ()
    unsupported = [tried("a", 1.0, supported=False)]
    assert with_equals(unsupported, 2.0, always, always)[0].equals == ()


def test_a_competitor_counts_whether_it_is_supported_itself_or_not():
    singles = [tried("a", 1.0), tried("b", 1.0, supported=False)]
    assert with_equals(singles, 2.0, lambda one, other: False, always)[0].competing == ("b",)


def test_a_supported_effect_competes_where_runs_do_not_tell_it_from_the_best():
    far = with_error(0.6 * EQUAL_SHARE)
    singles = [tried("a", 1.0), tried("near", far), tried("weak", far, supported=False)]

    def clear(one: Tried, other: Tried) -> bool:
        return other.name not in ("near", "weak")

    best, *_ = with_equals(singles, 2.0, lambda one, other: False, clear)
    assert best.competing == ("near",)
    assert with_equals(singles, 2.0, lambda one, other: False, always)[0].competing == ()
