"""What a person sees of an answer."""

from __future__ import annotations

import pytest

from service import cli
from tests.service.cli.command import START_AND_GOAL
from tests.service.cli.conftest import Fake


def test_people_see_what_other_routes_cost(fake: Fake, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["plan", "--map", "m", *START_AND_GOAL]) == 0
    shown = capsys.readouterr().out
    # 250 J against 200 J, and 140 J of the 200 J are rolling.
    assert "costs 25 % more" in shown
    assert "costs the same" in shown
    assert "140.0 J" in shown
    assert "70.0 %" in shown
    assert "(exchange)" in shown
    assert "fits the battery" in shown
