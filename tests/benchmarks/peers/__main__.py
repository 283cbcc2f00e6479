"""The command of tests.benchmarks.peers.comparison: python -m tests.benchmarks.peers."""

from __future__ import annotations

import json
import sys

from tests.benchmarks.peers.comparison import side_by_side

if __name__ == "__main__":
    print(json.dumps(side_by_side(sys.argv[1:]), indent=1, ensure_ascii=False))
