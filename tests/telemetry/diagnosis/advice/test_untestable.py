"""Why an effect that a log hints at is not named: nothing that the ranking contradicts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from planner.telemetry.diagnosis.advice.untestable import Untestable


@pytest.mark.parametrize("was_chosen", [True, False])
def test_a_hint_that_was_chosen_and_not_named_is_not_denied_by_held_out_rows(
    monkeypatch: pytest.MonkeyPatch, was_chosen: bool
) -> None:
    """It may lower their error, and be one of several that do, or absent from a second search."""
    member = SimpleNamespace(name="viscous_drag", sensor=False, columns=(0,))
    selection = SimpleNamespace(
        members=[member] if was_chosen else [],
        ranking=[SimpleNamespace(name=member.name, z=11.6, member=member)],
        aliases={},
    )
    examination = SimpleNamespace(testable={}, unnoticed=())
    advice: Any = SimpleNamespace(examination=examination, selection=selection)
    monkeypatch.setattr(Untestable, "what_would_help", lambda *_: "Drive faster.")
    (hint,) = Untestable(advice).listed(())
    assert "11.6 standard errors" in hint.why
    reason = "a later check does not confirm it" if was_chosen else "too little to name it"
    assert hint.why.endswith(reason)
