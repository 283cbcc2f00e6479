"""Logs as laboratories write them, of robots and sensors that nobody here has seen.

The virtual robot gives the physics alone. Robots, data sheets, drives and instruments are drawn
here at random, every log anew; see ``draw``.
"""

from tests.hidden_effects.laboratory.draw import KINDS, SPLITS, Log, Truth, draw
from tests.hidden_effects.laboratory.instruments import Instruments, Meter, Noise
from tests.hidden_effects.laboratory.mechanisms import MECHANISMS

__all__ = [
    "KINDS",
    "MECHANISMS",
    "SPLITS",
    "Instruments",
    "Log",
    "Meter",
    "Noise",
    "Truth",
    "draw",
]
