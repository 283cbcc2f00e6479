"""The demonstration prints comparison and account, writes its page, and says when it fails."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from planner.search.requests import PlanRequest
from service.demo import chapters
from tests.report.synthetic import answer


def run(monkeypatch: pytest.MonkeyPatch, report: Path, **changes: Any) -> int:
    """The demonstration's routes, by a planner that always gives the synthetic answer."""
    monkeypatch.setattr(
        chapters, "CHAPTERS", chapters.CHAPTERS[:2]
    )  # the rest: test_closing_the_loop
    monkeypatch.setattr(chapters, "plan_route", lambda request, **_: answer(**changes))
    return chapters.main(report)


def test_every_question_is_printed_and_pictured(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "demo" / "report.html"
    assert run(monkeypatch, report) == 0
    said, page = capsys.readouterr().out, report.read_text(encoding="utf-8")
    for question in (*chapters.RELIEF, *chapters.WAREHOUSE):
        assert question.heading in said
        assert question.heading in page
    # 320 J, of which a quarter climbs; the baseline costs a quarter more.
    for words in ("320.0 J", "80.0 J", "costs 25 % more", "climbing (exchange)"):
        assert words in said


def test_no_route_fails_the_demonstration(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nowhere = {"status": "no_route", "reason": "a wall", "routes": (), "baselines": {}}
    assert run(monkeypatch, tmp_path / "report.html", **nowhere) == 1
    assert "No route: a wall" in capsys.readouterr().out


def test_the_questions_are_requests() -> None:
    for question in (*chapters.RELIEF, *chapters.WAREHOUSE):
        PlanRequest.from_json(dict(question.request))
