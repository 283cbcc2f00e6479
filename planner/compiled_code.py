"""Where compiled code is kept, so that it is never older than the source it was made from.

numba checks a cached function against the file that the function stands in, not against the files
it calls or takes constants from. A change in one module could so leave stale code in another. The
cache therefore lives in a folder named after the state of all of the package's files: any change
gives a new folder. ``JOULEPATH_CACHE_DIR`` moves it; ``NUMBA_CACHE_DIR``, where set, is left alone.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import time
from pathlib import Path

KEPT_SECONDS = 7 * 24 * 3600
"""Folders of other states are removed once they were not used for a week."""


def cache_base() -> Path:
    """Folder for everything that joulepath compiles."""
    chosen = os.environ.get("JOULEPATH_CACHE_DIR")
    return Path(chosen) if chosen else Path.home() / ".cache" / "joulepath"


def settle() -> None:
    """Point numba at the folder for this state of the package; called before numba is imported."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    base = cache_base() / "compiled"
    folder = base / _state(Path(__file__).parent)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        _forget_old(base)
    except OSError:
        return  # numba falls back to folders beside the source, or compiles anew
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)


def _state(package: Path) -> str:
    digest = hashlib.sha256(sys.version.encode())
    for path in sorted(package.rglob("*.py")):
        stat = path.stat()
        digest.update(f"{path}{stat.st_mtime_ns}{stat.st_size}".encode())
    return digest.hexdigest()[:16]


def _forget_old(base: Path) -> None:
    for folder in base.iterdir():
        if time.time() - folder.stat().st_mtime > KEPT_SECONDS:
            shutil.rmtree(folder, ignore_errors=True)
