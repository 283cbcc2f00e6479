"""The command of tests.benchmarks.peers.comparison: python -m tests.benchmarks.peers."""

from __future__ import annotations

import json
import sys

from tests.benchmarks.peers.comparison import side_by_side
from tests.benchmarks.peers.report import table

if __name__ == "__main__":
    told = side_by_side(sys.argv[1:])
    print(table(told))
    print(json.dumps({k: told[k] for k in ("bars", "checks")}, indent=1, ensure_ascii=False))
    sys.exit(0 if told["holds"] else 1)
