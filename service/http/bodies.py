"""Bodies of requests: JSON of bounded size, and uploads streamed to the disk.

    asked = read_json(CompareRequest, await json_body(request, most=65536))
    async with receive_log(request, place, most=2**32) as upload: ...

An upload is either the log alone (any media type, its name in ``?name=``) or a form
(multipart/form-data) with the file ``log`` and optionally ``mapping``. Neither is ever whole in
memory.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from fastapi import HTTPException, Request
from pydantic import BaseModel, ValidationError
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header

from planner.errors import LogError, RequestError
from planner.validation import accepted_at, first_complaint, printable
from service.problems import TooLarge

_MOST_SMALL_FIELDS = 65_536  # bytes of all other fields of a form
_MOST_PARTS = 20
"""Of one form, so that a body of empty parts ends early."""
_WRITTEN_AT_ONCE = 1 << 20
_ACCEPTED = "the log as the body, or a form with the file 'log' and optionally 'mapping'"

T = TypeVar("T", bound=BaseModel)


async def json_body(request: Request, most: int, setting: str = "") -> bytes:
    """The body of a request, refused as soon as it is too large or not JSON.

    Args:
        request: whose body it is.
        most: bytes that it may have.
        setting: that says so.
    """
    media_type = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if media_type != "application/json":
        raise HTTPException(415, "the body must be JSON, sent with Content-Type: application/json")
    if (packed := request.headers.get("content-encoding", "identity")) != "identity":
        problem = f"the body is compressed (Content-Encoding: {printable(packed)})"
        raise HTTPException(415, f"{problem}; accepted: JSON as it is")
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > most:
            by = f", the service's JOULEPATH_{setting.upper()}" if setting else ""
            raise TooLarge(f"the body is larger than {most} bytes{by}")
    return bytes(body)


def read_json(kind: type[T], body: bytes) -> T:
    """A request of the workbench from JSON text.

    Raises:
        RequestError: the first field that cannot be used.
    """
    try:
        return kind.model_validate_json(body)
    except ValidationError as error:
        first = first_complaint(error.errors(include_url=False))
    problem = first.message[:1].lower() + first.message[1:]
    accepted = accepted_at(kind, first.location)
    raise RequestError(first.place or "request", problem, accepted=accepted)


@dataclass
class Upload:
    """A received log.

    Attributes:
        path: of its file.
        name: given by the sender.
        sha256, size: of its content; size in bytes.
        mapping: the mapping file sent with it.
    """

    path: Path
    name: str
    sha256: str = ""
    size: int = 0
    mapping: bytes | None = None


@asynccontextmanager
async def receive_log(request: Request, place: Path, most: int) -> AsyncIterator[Upload]:
    """Receive an upload; its file is removed at the end unless it was moved.

    Args:
        request: whose body it is.
        place: where to put it.
        most: largest number of bytes of the log.

    Raises:
        TooLarge: it is larger.
        LogError: the body is not an upload.
        ClientDisconnect: the sender disconnected.
    """
    upload = Upload(place, request.query_params.get("name") or "log")
    try:
        with place.open("wb") as file:
            sink = _Sink(file, most)
            kind, options = parse_options_header(request.headers.get("content-type"))
            boundary = options.get(b"boundary")
            if kind == b"multipart/form-data" and boundary:
                await _read_form(request, boundary, sink, upload)
            else:
                async for chunk in request.stream():
                    sink.take(chunk)
                    await sink.drain()
            await sink.drain(everything=True)
        if sink.count == 0:
            raise LogError("log", "is empty", accepted=_ACCEPTED)
        upload.sha256, upload.size = sink.digest.hexdigest(), sink.count
        yield upload
    finally:
        place.unlink(missing_ok=True)


class _Sink:
    """A file that is written in large pieces, away from the event loop."""

    def __init__(self, file: BinaryIO, most: int) -> None:
        self._file, self._most = file, most
        self._waiting = bytearray()
        self.count = 0
        self.digest = hashlib.sha256()

    def take(self, data: bytes) -> None:
        self.count += len(data)
        if self.count > self._most:
            raise TooLarge(f"the log is larger than {self._most} bytes")
        self._waiting += data

    async def drain(self, *, everything: bool = False) -> None:
        if self._waiting and (everything or len(self._waiting) >= _WRITTEN_AT_ONCE):
            waiting, self._waiting = bytes(self._waiting), bytearray()
            await asyncio.to_thread(self._write, waiting)

    def _write(self, data: bytes) -> None:
        self.digest.update(data)
        self._file.write(data)


class _Form:
    """Callbacks of the form parser; the file ``log`` goes to the sink, the rest is small."""

    def __init__(self, sink: _Sink, upload: Upload) -> None:
        self._sink = sink
        self._upload = upload
        self._header = self._disposition = self._field = b""
        self._small: dict[bytes, bytearray] = {}
        self._parts = 0
        self.finished = False

    def on_part_begin(self) -> None:
        self._parts += 1
        if self._parts > _MOST_PARTS:
            raise LogError("form", "has too many parts", accepted=_ACCEPTED)
        self._disposition = self._field = b""

    def on_header_field(self, data: bytes, start: int, end: int) -> None:
        self._header += data[start:end]

    def on_header_value(self, data: bytes, start: int, end: int) -> None:
        if self._header.lower() == b"content-disposition":
            self._disposition += data[start:end]

    def on_header_end(self) -> None:
        self._header = b""

    def on_headers_finished(self) -> None:
        _, options = parse_options_header(self._disposition)
        self._field = options.get(b"name", b"")
        if self._field == b"log":
            if self._sink.count:
                raise LogError("form", "contains two logs", accepted=_ACCEPTED)
            name = options.get(b"filename", b"").decode("utf-8", "replace")
            self._upload.name = name or self._upload.name
        elif self._field != b"mapping" and b"filename" in options:
            field = self._field.decode("utf-8", "replace")
            raise LogError("form", "has another file", value=field, accepted=_ACCEPTED)

    def on_part_data(self, data: bytes, start: int, end: int) -> None:
        if self._field == b"log":
            self._sink.take(data[start:end])
            return
        small = self._small.setdefault(self._field[:100], bytearray())
        small += data[start:end]
        if sum(len(part) for part in self._small.values()) > _MOST_SMALL_FIELDS:
            raise TooLarge(f"the fields beside the log are larger than {_MOST_SMALL_FIELDS} bytes")

    def on_end(self) -> None:
        self.finished = True

    def mapping(self) -> bytes | None:
        """The mapping file; None if it is missing or blank."""
        mapping = bytes(self._small.get(b"mapping", b""))
        return mapping if mapping.strip() else None


async def _read_form(request: Request, boundary: bytes, sink: _Sink, upload: Upload) -> None:
    form = _Form(sink, upload)
    callbacks: Any = {name: getattr(form, name) for name in dir(form) if name.startswith("on_")}
    try:
        parser = MultipartParser(boundary, callbacks)
        async for chunk in request.stream():
            parser.write(chunk)
            await sink.drain()
        parser.finalize()
    except FormParserError as error:
        raise LogError("form", f"cannot be read: {error}", accepted=_ACCEPTED) from None
    if not form.finished:
        raise LogError("form", "is incomplete", accepted=_ACCEPTED)
    upload.mapping = form.mapping()
