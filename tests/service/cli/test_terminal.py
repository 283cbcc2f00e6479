"""Ctrl-C asks first."""

from __future__ import annotations

import signal

import pytest

from service.cli import terminal


def test_the_first_interrupt_asks_and_the_second_insists() -> None:
    with terminal.interruptible() as cancelled:
        assert not cancelled()
        signal.raise_signal(signal.SIGINT)
        assert cancelled()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
