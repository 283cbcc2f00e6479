"""Sentences of the workbench's results, the same in terminals and pages."""

from planner.report.workbench_wording import about


def test_what_a_recommendation_is_for() -> None:
    assert about({"separates": []}) == ""
    assert about({"separates": ["wear"]}) == "To know wear better: "
    assert about({"separates": ["a", "b", "c"]}) == "To tell a, b and c apart: "
