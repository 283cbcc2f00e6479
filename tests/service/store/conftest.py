"""A store in a folder of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from service.settings import Settings
from service.store import Store


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """A store in a folder of its own."""
    return Settings(store_dir=tmp_path / "store")


@pytest.fixture
def store(settings: Settings) -> Iterator[Store]:
    """That store, opened."""
    opened = Store.open(settings)
    yield opened
    opened.close()
