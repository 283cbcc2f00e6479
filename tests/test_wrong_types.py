"""What is of the wrong type is refused in a sentence that says what would do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from planner import PowerModel, adopt, diagnose, plan_route, revert
from planner.errors import InputError
from planner.power.vehicles import load_vehicle
from planner.telemetry.virtual import VirtualRobot
from planner.terrain.heightmap import Terrain

LOG = "not-read.csv"
WRONG: dict[str, tuple[Callable[[], Any], str]] = {
    "a list as route": (lambda: VirtualRobot().drive_route([1]), "Answer of plan_route"),
    "poses without times": (
        lambda: VirtualRobot().drive_route({"poses": [{"x": 1.0}] * 3}),
        "the numbers t, x",
    ),
    "a vehicle in place of its name": (
        lambda: load_vehicle(load_vehicle("robotino")),  # type: ignore[arg-type]
        "minibalance, robotino",
    ),
    "a name in place of a vehicle": (
        lambda: PowerModel.from_vehicle("robotino"),  # type: ignore[arg-type]
        "load_vehicle",
    ),
    "no path of a model": (
        lambda: PowerModel.load(None),  # type: ignore[arg-type]
        "PowerModel.save",
    ),
    "no model to revert": (lambda: revert(None, 1), "PowerModel.save"),  # type: ignore[arg-type]
    "a number as effect": (
        lambda: adopt(3, LOG, "minibalance"),  # type: ignore[arg-type]
        "air_drag",
    ),
    "another class as effect": (
        lambda: adopt(int, LOG, "minibalance"),  # type: ignore[arg-type]
        "custom effect",
    ),
    "a name as custom effect": (
        lambda: diagnose(LOG, "minibalance", extra=["air_drag"]),  # type: ignore[list-item]
        "custom effects",
    ),
    "one length of a cell": (
        lambda: Terrain.from_arrays(np.zeros((5, 5)), cell=1.0),  # type: ignore[arg-type]
        "dx, dy",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_type_is_refused_with_what_would_do(name: str) -> None:
    call, words = WRONG[name]
    with pytest.raises(InputError) as caught:
        call()
    assert words in caught.value.accepted


@pytest.mark.parametrize("rows", [np.zeros((3, 2)), np.zeros(40), [[0.0]], "rows"])
def test_rows_of_another_shape_have_no_power(rows: Any) -> None:
    """Compiled code would read whatever lies behind them."""
    model = PowerModel.from_vehicle(load_vehicle("minibalance"))
    for ask in (model.watts, model.power_and_limits):
        with pytest.raises(InputError, match="rows_from"):
            ask(rows)


def test_what_the_planner_gives_can_be_driven() -> None:
    answer = plan_route(map="test-bench", start=(1, 1.5), goal=(3, 1.5))
    robot = VirtualRobot()
    energy, _ = robot.drive_route(answer)
    # The robot is another than the model, but of the same size.
    assert energy == pytest.approx(answer.routes[0].energy_j, rel=0.3)
    assert (
        robot.drive_route(answer.routes[0])[0] == robot.drive_route(answer.to_json())[0] == energy
    )
