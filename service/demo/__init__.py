"""What joulepath does, shown in two minutes: ``python -m service.demo``, run by ``make demo``.

story = close_the_loop(ERRANDS, "minibalance", {"regeneration_limit": {}}, Path("demo"))
"""

from service.demo.chapters import main
from service.demo.closing_the_loop import ERRANDS, ClosedLoop, Errand, close_the_loop

__all__ = ["ERRANDS", "ClosedLoop", "Errand", "close_the_loop", "main"]
