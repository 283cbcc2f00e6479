"""Benchmarks that no test runs are there when somebody wants them: each can be loaded."""

import importlib
from pathlib import Path

import pytest

HERE = Path(__file__).parent
NAMES = sorted(
    ".".join(("tests", "benchmarks", *file.relative_to(HERE).with_suffix("").parts))
    for file in HERE.rglob("*.py")
    if file.stem not in ("__main__", "__init__", Path(__file__).stem)
)


@pytest.mark.parametrize("name", NAMES)
def test_it_loads(name):
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as missing:
        if str(missing.name).startswith(("planner", "tests")):
            raise
        pytest.skip(f"{missing.name} is installed for benchmarks only")
