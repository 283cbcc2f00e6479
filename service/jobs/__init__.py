"""Solving away from the event loop: worker processes and what runs in them."""
