"""Names of files that come from outside."""

from __future__ import annotations

import pytest

from service.store.files import safe_name


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("drive.csv", "drive.csv"),
        ("../../etc/passwd", "passwd"),
        ("C:\\logs\\ride 1.csv.gz", "ride 1.csv.gz"),
        ("..", "log"),
        (".hidden", "hidden"),
        ("a\x00b\n.csv", "a_b_.csv"),
        ("mapping.toml", "log-mapping.toml"),
        ("x" * 300 + ".parquet", "x" * 112 + ".parquet"),
        # Three bytes a character, four, and one that is cut in the middle.
        ("走" * 200 + ".parquet", "走" * 37 + ".parquet"),
        ("𝒙" * 200 + ".csv", "𝒙" * 29 + ".csv"),
        ("a" + "é" * 200, "a" + "é" * 59),
        ("a." + "走" * 200, "a." + "走" * 39),
        ("", "log"),
    ],
)
def test_names_from_outside_become_plain_names(given: str, kept: str) -> None:
    assert safe_name(given) == kept
