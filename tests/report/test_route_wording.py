"""How routes compare is the number that was meant."""

import pytest

from planner.report.route_wording import extra_cost, extra_share, notes, of_battery, width_from


@pytest.mark.parametrize(
    ("energy", "best", "text"),
    [
        (246.0, 200.0, "costs 23 % more"),
        (204.0, 200.0, "costs 2.0 % more"),
        (200.05, 200.0, "costs the same"),
        (150.0, 200.0, "costs 25 % less"),
        # Downhill with recovery the best route gives energy back: no share of it makes sense.
        (50.0, -100.0, "costs 150.0 J more"),
    ],
)
def test_extra_cost(energy: float, best: float, text: str) -> None:
    assert extra_cost(energy, best) == text


@pytest.mark.parametrize(
    ("energy", "best", "text"),
    [
        (246.0, 200.0, "+23 %"),
        (204.0, 200.0, "+2.0 %"),
        (150.0, 200.0, "-25 %"),
        (50.0, -100.0, "+150.0 J"),
    ],
)
def test_extra_share(energy: float, best: float, text: str) -> None:
    assert extra_share(energy, best) == text


def test_where_the_width_comes_from() -> None:
    parts = [
        {"effect": "wheel_rolling", "parameter": "rolling", "share_of_variance": 0.61},
        {"effect": "noise", "parameter": "one drive", "share_of_variance": 0.3},
        {"effect": "yaw_scrub", "parameter": "scrub_moment", "share_of_variance": 0.09},
    ]
    titles = {"wheel_rolling": "rolling of the wheels"}
    assert width_from(parts, titles, 2) == (
        "rolling of the wheels (rolling) 61 %, noise of one drive 30 %"
    )
    assert width_from(parts[2:], {}) == "yaw_scrub (scrub moment) 9 %"


def test_rounding_errors_have_no_sign() -> None:
    assert extra_share(200.0 - 1e-9, 200.0) == "+0.0 %"
    assert extra_share(150.0, 200.0) == "-25 %"


@pytest.mark.parametrize(
    ("used", "text"), [(1.8, "180 %"), (0.4567, "46 %"), (0.0123, "1.2 %"), (0.00042, "0.042 %")]
)
def test_the_battery_is_never_in_powers_of_ten(used: float, text: str) -> None:
    assert of_battery(used) == text


def test_a_note_ends_with_one_mark() -> None:
    document = {"notes": ["flat ground taken", "is a unit missing?"]}
    assert list(notes(document)) == ["Note: flat ground taken.", "Note: is a unit missing?"]
