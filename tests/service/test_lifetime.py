"""A worker ends with the process that started it, however that one ends."""

import os
import select
import subprocess
import sys

import pytest

PARENT = """
import multiprocessing, os, time
from concurrent.futures import ProcessPoolExecutor
from service.lifetime import end_with_parent
if __name__ == "__main__":
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), end_with_parent)
    print(pool.submit(os.getpid).result(), flush=True)
    input()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="signals of pipes are Linux's")
def test_a_worker_ends_with_a_parent_that_is_killed() -> None:
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    worker = os.pidfd_open(int(parent.stdout.readline()))
    try:
        assert select.select([worker], [], [], 0.0)[0] == []  # alive
        parent.kill()
        parent.communicate()
        assert select.select([worker], [], [], 20.0)[0] == [worker]
    finally:
        os.close(worker)
