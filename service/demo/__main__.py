"""Entry point of ``python -m service.demo``."""

from __future__ import annotations

import os
import sys

from service.demo.chapters import main

if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    # OMPL's bindings list objects that they leak on stderr when the interpreter shuts down.
    os._exit(status)
