"""Worker processes end with the process that started them, even if it crashes."""

from __future__ import annotations

import fcntl
import multiprocessing
import os
import signal
import sys
from multiprocessing.connection import wait


def end_with_parent() -> None:
    """Let the system kill this process, with the group that it leads, when its parent ends.

    Only the parent holds the other end of this pipe. The signal comes from the system, since a
    thread that watches the pipe would wait for compiled code too. Elsewhere than on Linux a worker
    ends when it has nothing more to do.
    """
    parent = multiprocessing.parent_process()
    if parent is None or sys.platform != "linux":
        return
    pipe = int(parent.sentinel)
    leads = os.getpgrp() == os.getpid()
    fcntl.fcntl(pipe, fcntl.F_SETOWN, -os.getpid() if leads else os.getpid())
    fcntl.fcntl(pipe, fcntl.F_SETSIG, signal.SIGKILL)
    fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)
    if wait([pipe], timeout=0):
        # It ended before this took effect.
        os._exit(1)
