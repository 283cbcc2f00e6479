"""Find the format of a telemetry log, and refuse what is not a table.

``open_log`` looks at the first bytes and the headings: separator, decimal sign, byte-order mark,
gzip, comment lines. ``open_table`` takes a table in memory, such as a DataFrame of pandas.
planner.telemetry.logs.files reads the rows.
"""

from __future__ import annotations

import csv
import gzip
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from planner.errors import LogError
from planner.telemetry.logs.files import ACCEPTED, LogFile

MOST_COLUMNS = 2_000
"""Columns of a log; more are a sign of another kind of file."""
MOST_COMMENTS = 1_000
"""Lines that begin with # above the headings."""
LONGEST_HEADER = 1_000_000
"""Bytes of the line of headings; a longer one is a sign of another kind of file."""
TABLE_ACCEPTED = "a table with the columns of a log, one value a cell, distinct headings"
_DATE = re.compile(
    r"\s*\d{4}-\d{2}-\d{2}[T ]\d{2}:\d{2}:\d{2}(\.\d{1,9})?(?P<zone>Z|[+-]\d{2}:?\d{2})?\s*"
)
"""A moment as ISO 8601 writes it."""
_SAMPLE_BYTES = 20_000
"""Bytes below the headings that show the decimal sign."""


def open_log(path: Path) -> LogFile:
    """Look at a file's first bytes and headings.

    Raises:
        LogError: it cannot be opened, or is not a table.
    """
    where = str(path)
    try:
        if path.is_dir():
            raise LogError(where, "is a folder", accepted=ACCEPTED)
        with path.open("rb") as file:
            start = file.read(16)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a path"
        raise LogError(where, f"cannot be opened: {reason}", accepted=ACCEPTED) from error
    if not start:
        raise LogError(where, "is empty", accepted=ACCEPTED)
    if start[:4] == b"PAR1":
        return _open_parquet(path)
    for magic, name in _OTHER_FORMATS.items():
        if start.startswith(magic):
            raise LogError(where, f"is {name}", accepted=ACCEPTED)
    return _open_csv(path, gzipped=start[:2] == b"\x1f\x8b")


def open_table(table: Any) -> LogFile:
    """A table in memory as a log: a DataFrame of pandas, or any table that Arrow can read.

    An index counts as a column where it has a name.

    Raises:
        LogError: its columns cannot be read, or it has no rows.
    """
    where = type(table).__name__
    try:
        arrow = pa.table(table)
    except (pa.ArrowException, TypeError, ValueError) as error:
        problem = f"cannot be read: {' '.join(str(error).split())[:160]}"
        raise LogError(where, problem, accepted=TABLE_ACCEPTED) from None
    if arrow.num_rows == 0:
        raise LogError(where, "has no rows", accepted=TABLE_ACCEPTED)
    names = [name.strip() for name in arrow.column_names]
    _check_headings(where, names)
    written, dates = arrow.column_names, _dates(arrow.schema)
    return LogFile(
        Path(where), "table", names, headings_as_written=written, dates=dates, table=arrow
    )


_OTHER_FORMATS = {
    b"PK\x03\x04": "a ZIP archive or a spreadsheet",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet",
    b"\x89HDF": "an HDF5 file",
    b"\x93NUMPY": "a NumPy file",
    b"%PDF": "a PDF document",
    b"\x89PNG": "a picture",
    b"MATLAB": "a MATLAB file",
    b"ARROW1": "an Arrow (Feather) file",
    b"\xff\xfe": "UTF-16 text",
    b"\xfe\xff": "UTF-16 text",
    b"BZh": "compressed with bzip2",
    b"\xfd7zXZ": "compressed with xz",
    b"\x28\xb5\x2f\xfd": "compressed with Zstandard",
    b"SQLite format 3": "an SQLite database that is not named .db3",
}


def _open_parquet(path: Path) -> LogFile:
    where = str(path)
    try:
        with pq.ParquetFile(path) as file:
            schema, count = file.schema_arrow, file.metadata.num_rows
    except (pa.ArrowException, OSError, ValueError) as error:
        raise LogError(
            where, "is a Parquet file that is cut off or damaged", accepted=ACCEPTED
        ) from error
    if count == 0:
        raise LogError(where, "has headings and no rows", accepted=ACCEPTED)
    names = [name.strip() for name in schema.names]
    _check_headings(where, names)
    written = list(schema.names)
    return LogFile(path, "parquet", names, headings_as_written=written, dates=_dates(schema))


def _dates(schema: Any) -> dict[str, bool]:
    """Headings of moments and durations, which state their unit, and whether with a zone."""
    return {
        field.name.strip(): getattr(field.type, "tz", None) is not None
        for field in schema
        if pa.types.is_timestamp(field.type) or pa.types.is_duration(field.type)
    }


def _open_csv(path: Path, *, gzipped: bool) -> LogFile:
    where = str(path)
    opener: Any = gzip.open if gzipped else open
    try:
        with opener(path, "rb") as file:
            header, comments = file.readline(LONGEST_HEADER), 0
            # Excel writes a line sep=; to itself.
            while (
                header.lstrip(b"\xef\xbb\xbf").startswith((b"#", b"sep="))
                and comments < MOST_COMMENTS
            ):
                header, comments = file.readline(LONGEST_HEADER), comments + 1
            sample = file.read(_SAMPLE_BYTES)
    except (OSError, EOFError) as error:
        raise LogError(where, "is a gzip file that is damaged", accepted=ACCEPTED) from error
    if len(header) >= LONGEST_HEADER:
        raise LogError(
            where, f"its first line is longer than {LONGEST_HEADER} bytes", accepted=ACCEPTED
        )
    if b"\x00" in header + sample:
        raise LogError(where, "is not text (it has zero bytes)", accepted=ACCEPTED)
    notes = ["gzip"] if gzipped else []
    if comments:
        notes.append(f"{comments} comment lines above the headings")
    try:
        line = header.decode("utf-8").rstrip("\r\n")
    except UnicodeDecodeError as error:
        raise LogError(where, "its headings are not UTF-8", accepted=ACCEPTED) from error
    if line.startswith("\ufeff"):
        line = line[1:]
        notes.append("byte-order mark")
    if "\r" in line:
        raise LogError(
            where, "its lines end with a carriage return alone", accepted="line ends LF or CR LF"
        )
    if line.lstrip().startswith(("{", "[", "<")):
        raise LogError(where, "is JSON, XML or HTML, not a table", accepted=ACCEPTED)
    if not line.strip():
        raise LogError(where, "its first line is blank", accepted="headings in the first line")
    separator = max(",;\t|", key=line.count)
    if line.count(separator) == 0:
        raise LogError(
            where,
            "its first line has no separator, so it is not a table",
            value=line[:60],
            accepted="headings separated by comma, semicolon, tab or bar",
        )
    if separator != ",":
        notes.append(f"separator {separator!r}")
    body = sample.decode("utf-8", "replace")
    decimal = "."
    if separator != "," and re.search(r"\d,\d", body) and not re.search(r"\d\.\d", body):
        decimal = ","
        notes.append("decimal commas")
    names = [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    if all(_is_number(name) for name in names):
        raise LogError(
            where,
            "its first line holds numbers where headings belong",
            value=line[:60],
            accepted="the names of the columns in the first line",
        )
    _check_headings(where, names)
    if not sample.strip():
        raise LogError(where, "has headings and no rows", accepted=ACCEPTED)
    first = next(csv.reader([body.lstrip().partition("\n")[0].rstrip("\r")], delimiter=separator))
    moments = {name: _DATE.fullmatch(cell) for name, cell in zip(names, first, strict=False)}
    dates = {name: found["zone"] is not None for name, found in moments.items() if found}
    notes += [f"{name} is a date, taken as seconds since 1970" for name in dates]
    return LogFile(
        path, "csv", names, notes, [], separator, decimal, gzipped, names, comments, dates=dates
    )


def _check_headings(where: str, names: Sequence[str]) -> None:
    if len(names) > MOST_COLUMNS:
        raise LogError(
            where, "has too many columns", value=len(names), accepted=f"at most {MOST_COLUMNS}"
        )
    for name, count in Counter(names).items():
        if name and count > 1:
            raise LogError(
                where, "two columns have the same heading", value=name, accepted="distinct headings"
            )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
