"""Where the store keeps its files.

STORE/joulepath.db                    the database, unless its address says otherwise
STORE/incoming/                       unfinished uploads
STORE/logs/<id>/<name>, mapping.toml  logs, under their original names
STORE/models/<id>.json                versions of models, copied from the database
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from planner.errors import InputError
from service.documents import write_whole

MAPPING = "mapping.toml"
_LONGEST_NAME = 120
"""Bytes of a log's name: file systems allow 255, encrypted ones 143."""
_ABANDONED_S = 24 * 3600.0
_FOLDERS = ("incoming", "logs", "models")


def default_folder() -> Path:
    """The user's data folder."""
    base = os.environ.get("XDG_DATA_HOME")
    return (Path(base) if base else Path.home() / ".local" / "share") / "joulepath"


def safe_name(name: str) -> str:
    """A name from outside as a plain file name."""
    last = re.split(r"[/\\]", name)[-1]
    plain = "".join(c if c.isalnum() or c in "._- ()+" else "_" for c in last).strip(". ")
    stem, dot, suffix = plain.rpartition(".")
    room = _LONGEST_NAME - len(f".{suffix}".encode())
    short = f"{_cut(stem, room)}.{suffix}" if dot and stem and room > 0 else plain
    short = _cut(short, _LONGEST_NAME) or "log"
    return f"log-{short}" if short == MAPPING else short


def _cut(text: str, most: int) -> str:
    """The beginning of a text, of at most ``most`` bytes."""
    return text.encode()[:most].decode(errors="ignore")


@dataclass(frozen=True)
class Files:
    """The folders of one store.

    Attributes:
        folder: STORE.
    """

    folder: Path

    def prepare(self) -> None:
        """Create the folders, and remove abandoned uploads.

        Raises:
            InputError: the folder cannot be written.
        """
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            for name in _FOLDERS:
                (self.folder / name).mkdir(exist_ok=True)
            for left in (self.folder / "incoming").iterdir():
                # Another service may remove or move the upload meanwhile.
                with suppress(FileNotFoundError):
                    if time.time() - left.stat().st_mtime > _ABANDONED_S:
                        left.unlink()
            probe = self.folder / f".{secrets.token_hex(4)}"
            probe.touch()
            probe.unlink()
        except OSError as error:
            raise InputError(
                "JOULEPATH_STORE_DIR",
                f"cannot be written: {error.strerror}",
                value=str(self.folder),
                accepted="a folder for logs, models and jobs",
            ) from None

    def problem(self) -> str | None:
        """Why the folders cannot be used any more, or None."""
        for name in _FOLDERS:
            if not os.access(self.folder / name, os.W_OK | os.X_OK):
                return f"the store's folder {name} was removed or cannot be written"
        return None

    def incoming(self) -> Path:
        """Path for a new upload."""
        return self.folder / "incoming" / secrets.token_hex(8)

    def log_folder(self, log: str) -> Path:
        """Folder of a log and its mapping."""
        return self.folder / "logs" / log

    def take_in(self, upload: Path, log: str, name: str, mapping: bytes | None) -> str:
        """Move an upload to its log's folder, which may exist already.

        Returns:
            the plain name of its file.
        """
        folder = self.log_folder(log)
        folder.mkdir(parents=True, exist_ok=True)
        if mapping is not None:
            (folder / MAPPING).write_bytes(mapping)
        plain = safe_name(name)
        upload.replace(folder / plain)
        return plain

    def drop_log(self, log: str) -> None:
        """Remove a log's folder."""
        shutil.rmtree(self.log_folder(log), ignore_errors=True)

    def model(self, model: str, document: str) -> Path:
        """Path of a model's file, which is written if it is missing."""
        path = self.folder / "models" / f"{model}.json"
        if not path.exists():
            write_whole(path, document)
        return path
