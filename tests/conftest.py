"""What holds for all tests."""

from hypothesis import HealthCheck, settings

# How long a draw takes says how busy the machine is, and nothing of the code.
slow = [HealthCheck.too_slow]
settings.register_profile("any machine", deadline=None, suppress_health_check=slow)
settings.load_profile("any machine")
