"""What holds for all tests."""

import gc

from hypothesis import HealthCheck, settings

# How long a draw takes says how busy the machine is, and nothing of the code.
slow = [HealthCheck.too_slow]
settings.register_profile("any machine", deadline=None, suppress_health_check=slow)
settings.load_profile("any machine")

NEW_OBJECTS = 20_000
"""Objects after which garbage is collected. At Python's 700, time goes into looking again and again
at those that stay."""
gc.set_threshold(NEW_OBJECTS, *gc.get_threshold()[1:])


def pytest_collection_finish() -> None:
    """What importing and collecting made stays."""
    gc.freeze()
