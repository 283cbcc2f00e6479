"""Relief as an image: where north is, and what is dark."""

from __future__ import annotations

from planner.report.routes.relief_image import relief_image
from tests.report.synthetic import terrain


def test_north_is_up_and_obstacles_are_dark() -> None:
    ground = terrain()
    picture = relief_image(ground, ground.extent, pixels=200)
    assert picture.size == (200, 100)
    # The obstacle is at (18.5, 8.5): right and near the upper edge.
    assert max(picture.getpixel((185, 15))) < 100  # type: ignore[type-var]
    # The hole is at (1.5, 1.5): left and near the lower edge.
    assert picture.getpixel((15, 85)) == (236, 236, 238)
