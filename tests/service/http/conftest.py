"""A workbench behind the service of a test."""

from __future__ import annotations

import pytest

from tests.service.conftest import ScriptedWorkers
from tests.service.workbench import Workbench


@pytest.fixture
def bench(workers: ScriptedWorkers) -> Workbench:
    """What the workers do."""
    made = Workbench()
    workers.work = made
    return made
