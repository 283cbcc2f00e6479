"""Read a telemetry log block by block: CSV (gzip, any common separator) and Parquet.

A block holds the columns that are wanted as float64 arrays (NaN where a cell is empty) and the text
columns (``run``, ``surface``) as codes into their labels. Nothing of the physics is known here.

Row numbers count the samples of the file: row 1 is the first line below the heading.
"""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from planner.arrays import Array, Integers
from planner.errors import LogError

ACCEPTED = "a CSV (UTF-8, one line of headings, one row a sample; may be gzipped) or a Parquet file"
MISSING_CELLS = ("", "NaN", "nan", "-nan", "NA", "N/A", "#N/A", "null", "NULL", "None", "n/a")
_NUMBER = re.compile(
    r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?(inf|infinity|nan)", re.IGNORECASE
)
_MOST_AT_ONCE = 500_000  # rows of Parquet read at a time
_BLOCK = 1 << 23  # bytes of CSV parsed at a time; a line must fit into it


@dataclass
class Block:
    """Some consecutive rows of a log.

    Attributes:
        numbers: column name to (n,) values, NaN where the cell is empty.
        labels: column name to ((n,) codes with -1 for an empty cell, labels of the codes).
        rows: (n,) numbers of the rows in the file, from 1.
    """

    numbers: dict[str, Array]
    labels: dict[str, tuple[Integers, list[str]]]
    rows: Integers


@dataclass
class LogFile:
    """An opened log: its headings, and how it was read.

    Attributes:
        path: the file.
        kind: "csv" or "parquet".
        columns: headings, without blanks around them.
        notes: what was found about the format, in sentences (separator, byte-order mark ...).
        ragged: rows of the file that have too few or too many cells, filled while reading.
    """

    path: Path
    kind: str
    columns: list[str]
    notes: list[str] = field(default_factory=list)
    ragged: list[int] = field(default_factory=list)
    separator: str = ","
    decimal: str = "."
    gzipped: bool = False
    headings_as_written: list[str] = field(default_factory=list)
    comments: int = 0

    def blocks(self, numeric: Sequence[str], text: Sequence[str], rows: int) -> Iterator[Block]:
        """The wanted columns in blocks of at most ``rows`` rows.

        Raises:
            LogError: a cell is no number, or the file breaks off.
        """
        if self.kind == "csv":
            batches = self._csv(numeric, text)
        else:
            batches = self._parquet(numeric, text, min(rows, _MOST_AT_ONCE))
        first = 1
        try:
            for batch in batches:
                for start in range(0, batch.num_rows, rows):
                    part = batch.slice(start, rows)
                    yield self._block(part, numeric, text, first)
                    first += part.num_rows
        except (pa.ArrowException, OSError, EOFError, ValueError) as error:
            if isinstance(error, LogError):
                raise
            raise self._broken(error, first, numeric) from error

    def _csv(self, numeric: Sequence[str], text: Sequence[str]) -> Iterator[Any]:
        def skip(row: Any) -> str:
            self.ragged.append(int(row.number or 0) - 1)
            return "skip"

        types = {name: pa.float64() for name in numeric} | {name: pa.string() for name in text}
        file = _Utf8(self.path, self.gzipped)
        reader = pa_csv.open_csv(
            pa.PythonFile(file, mode="r"),
            read_options=pa_csv.ReadOptions(
                use_threads=False,
                block_size=_BLOCK,
                skip_rows=1 + self.comments,
                column_names=self.columns,
            ),
            parse_options=pa_csv.ParseOptions(
                delimiter=self.separator, invalid_row_handler=skip, ignore_empty_lines=True
            ),
            convert_options=pa_csv.ConvertOptions(
                column_types=types,
                include_columns=[*numeric, *text],
                null_values=list(MISSING_CELLS),
                strings_can_be_null=True,
                decimal_point=self.decimal,
            ),
        )
        try:
            yield from reader
        finally:
            file.close()

    def _parquet(self, numeric: Sequence[str], text: Sequence[str], rows: int) -> Iterator[Any]:
        written = dict(zip(self.columns, self.headings_as_written, strict=True))
        wanted = [written[name] for name in (*numeric, *text)]
        # Buffers read ahead would be kept until the end of the file.
        with pq.ParquetFile(self.path, pre_buffer=False) as file:
            for batch in file.iter_batches(batch_size=rows, columns=wanted):
                yield pa.RecordBatch.from_arrays(
                    [batch.column(batch.schema.get_field_index(name)) for name in wanted],
                    names=[*numeric, *text],
                )

    def _block(self, batch: Any, numeric: Sequence[str], text: Sequence[str], first: int) -> Block:
        numbers = {
            name: _floats(batch.column(batch.schema.get_field_index(name)), self.path, name)
            for name in numeric
        }
        labels = {name: _codes(batch.column(batch.schema.get_field_index(name))) for name in text}
        rows = np.arange(first, first + batch.num_rows, dtype=np.int64)
        if self.ragged:  # Skipped rows still count as rows of the file.
            skipped = np.array(self.ragged) - np.arange(len(self.ragged))
            rows += np.searchsorted(skipped, rows, side="right")
        return Block(numbers, labels, rows)

    def _broken(self, error: Exception, row: int, numeric: Sequence[str]) -> LogError:
        message = " ".join(str(error).split())
        where = str(self.path)
        if "utf8" in message.lower() or "utf-8" in message.lower():
            return LogError(where, "is not UTF-8 text throughout", accepted=ACCEPTED)
        if "conversion error" in message.lower() and self.kind == "csv":
            found = self._bad_cell(numeric)
            if found:
                column, at, cell = found
                return LogError(
                    where,
                    f"column {column!r} has a cell that is no number in row {at}",
                    value=cell,
                    accepted="numbers with a decimal point; empty, NaN or NA where nothing was "
                    "measured",
                )
        if "straddling" in message or "block" in message.lower():
            return LogError(where, f"a line after row {row} is too long", accepted=ACCEPTED)
        return LogError(where, f"breaks off or is damaged after row {row - 1}", accepted=ACCEPTED)

    def _bad_cell(self, numeric: Sequence[str]) -> tuple[str, int, str] | None:
        wanted = [(self.columns.index(name), name) for name in numeric]
        opener: Any = gzip.open if self.gzipped else open
        with opener(self.path, "rt", encoding="utf-8-sig", errors="replace", newline="") as lines:
            reader = csv.reader(lines, delimiter=self.separator)
            for _ in range(self.comments + 1):
                next(reader, None)
            at = 0
            for cells in reader:
                if not cells:
                    continue
                at += 1
                if len(cells) != len(self.columns):
                    continue
                for place, name in wanted:
                    cell = cells[place].strip()
                    if cell in MISSING_CELLS:
                        continue
                    if not _NUMBER.fullmatch(cell.replace(self.decimal, ".")):
                        return name, at, cell
        return None


def _opened(path: Path, gzipped: bool) -> Any:
    return gzip.open(path, "rb") if gzipped else path.open("rb")


class _Utf8(io.RawIOBase):
    """Bytes of a file, unzipped; raises where they are no UTF-8, which the parser would skip."""

    def __init__(self, path: Path, gzipped: bool) -> None:
        super().__init__()
        self._file = _opened(path, gzipped)
        self._decoder = codecs.getincrementaldecoder("utf-8")()

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1) -> bytes:
        part: bytes = self._file.read(size)
        self._decoder.decode(part, final=not part)
        return part

    def close(self) -> None:
        self._file.close()
        super().close()


def _floats(column: Any, path: Path, name: str) -> Array:
    kind = column.type
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        per_second = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[kind.unit]
        ticks = column.cast(pa.int64())
        return _floats(ticks, path, name) / per_second
    if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
        if pa.types.is_null(kind):
            return np.full(len(column), np.nan)
        raise LogError(
            str(path), f"column {name!r} holds {kind}, not numbers", accepted="a numeric column"
        )
    # safe=False: an integer beyond 2**53 (time in ns since 1970) may lose its last digits.
    return np.array(
        pc.fill_null(pc.cast(column, pa.float64(), safe=False), np.nan).to_numpy(
            zero_copy_only=False
        ),
        dtype=np.float64,
    )


def _codes(column: Any) -> tuple[Integers, list[str]]:
    if pa.types.is_dictionary(column.type):
        column = pc.cast(column, column.type.value_type)
    if not pa.types.is_string(column.type):
        column = pc.cast(column, pa.string())
    encoded = column.dictionary_encode()
    codes = pc.fill_null(encoded.indices, -1).to_numpy(zero_copy_only=False).astype(np.int64)
    return codes, [str(label).strip() for label in encoded.dictionary.to_pylist()]
