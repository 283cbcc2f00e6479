"""Effects with a colour of their own, and the others as one."""

from __future__ import annotations

import numpy as np
import pytest

from planner.report.routes.effects import grouped


def test_what_is_grouped_adds_up() -> None:
    values = {"a": np.array([3.0]), "b": np.array([-1.0]), "c": np.array([0.5])}
    parts = grouped(values, ["a"])
    assert parts["other"] == pytest.approx(-0.5)
    assert sum(parts.values()) == pytest.approx(2.5)
