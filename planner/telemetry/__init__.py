"""Measured logs: reading them, comparing them with a power model, naming what is missing."""
