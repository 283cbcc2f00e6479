"""Read a telemetry log block by block: CSV (gzip, any common separator) and Parquet.

A block holds the wanted columns as float64 arrays (NaN where a cell is empty). Text columns
(``run``, ``surface``) are codes into their labels. This module knows nothing of the physics.

Row numbers count the samples of the file: row 1 is the first line below the heading.
"""

from __future__ import annotations

import codecs
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
_BAD_CELL = re.compile(r"column #(\d+): Row #(\d+): .*invalid value '(.*)'")
"""Where the parser says that a cell is not a number."""
_PARQUET_ROWS = 500_000
"""Rows of Parquet read at a time."""
_CSV_BYTES = 1 << 23
"""Bytes of CSV parsed at a time; a line must fit into it."""


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
        path: the file, or the name of a table in memory.
        kind: "csv", "parquet", "table" or "recording".
        columns: headings, without blanks around them.
        notes: what was found about the format, in sentences (separator, byte-order mark ...).
        dates: headings of moments, as ISO 8601 writes them or as Arrow types them, and whether they
            name their zone; durations of Arrow as well.
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
    dates: dict[str, bool] = field(default_factory=dict)
    table: Any = None

    def blocks(self, numeric: Sequence[str], text: Sequence[str], rows: int) -> Iterator[Block]:
        """The wanted columns in blocks of at most ``rows`` rows.

        Raises:
            LogError: a cell is not a number, or the file breaks off.
        """
        if self.kind == "csv":
            batches = self._csv(numeric, text)
        elif self.kind == "table":
            batches = iter(self._wanted(self.table, numeric, text).to_batches(rows))
        else:
            batches = self._parquet(numeric, text, min(rows, _PARQUET_ROWS))
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
            raise self._broken(error, first) from error

    def _csv(self, numeric: Sequence[str], text: Sequence[str]) -> Iterator[Any]:
        def skip(row: Any) -> str:
            self.ragged.append(int(row.number or 0) - 1)
            return "skip"

        decoder = codecs.getincrementaldecoder("utf-8")()

        def checked(part: Any) -> Any:
            # The parser itself would pass over bytes that are not UTF-8.
            decoder.decode(part, final=not len(part))
            return part

        moments = {
            k: pa.timestamp("ns", "UTC" if zoned else None) for k, zoned in self.dates.items()
        }
        types = {name: moments.get(name, pa.float64()) for name in numeric} | {
            name: pa.string() for name in text
        }
        file: Any = pa.OSFile(str(self.path))
        file = pa.CompressedInputStream(file, "gzip") if self.gzipped else file
        reader = pa_csv.open_csv(
            pa.TransformInputStream(file, checked),
            read_options=pa_csv.ReadOptions(
                use_threads=False,
                block_size=_CSV_BYTES,
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
        with file:
            yield from reader

    def _parquet(self, numeric: Sequence[str], text: Sequence[str], rows: int) -> Iterator[Any]:
        wanted = self._written(numeric, text)
        # Buffers read ahead would be kept until the end of the file.
        with pq.ParquetFile(self.path, pre_buffer=False) as file:
            for batch in file.iter_batches(batch_size=rows, columns=wanted):
                yield self._wanted(batch, numeric, text)

    def _written(self, numeric: Sequence[str], text: Sequence[str]) -> list[str]:
        """The headings of columns as the file has them."""
        written = dict(zip(self.columns, self.headings_as_written, strict=True))
        return [written[name] for name in (*numeric, *text)]

    def _wanted(self, rows: Any, numeric: Sequence[str], text: Sequence[str]) -> Any:
        """The wanted columns in the order that is wanted, which need not be that of the file."""
        return rows.select(self._written(numeric, text)).rename_columns([*numeric, *text])

    def _block(self, batch: Any, numeric: Sequence[str], text: Sequence[str], first: int) -> Block:
        numbers = {
            name: _floats(batch.column(place), self.path, name)
            for place, name in enumerate(numeric)
        }
        labels = {name: _codes(batch.column(len(numbers) + k)) for k, name in enumerate(text)}
        rows = np.arange(first, first + batch.num_rows, dtype=np.int64)
        if self.ragged:  # Skipped rows still count as rows of the file.
            skipped = np.array(self.ragged) - np.arange(len(self.ragged))
            rows += np.searchsorted(skipped, rows, side="right")
        return Block(numbers, labels, rows)

    def _broken(self, error: Exception, row: int) -> LogError:
        message = " ".join(str(error).split())
        where = str(self.path)
        if "utf8" in message.lower() or "utf-8" in message.lower():
            return LogError(where, "is not UTF-8 text throughout", accepted=ACCEPTED)
        if cell := _BAD_CELL.search(message):
            # The parser counts the lines above the first row as well.
            name, at = self.columns[int(cell[1])], int(cell[2]) - 1 - self.comments
            return LogError(
                where,
                f"column {name!r} has a cell that is not a number in row {at}",
                value=cell[3].strip(),
                accepted="numbers with a decimal point; empty, NaN or NA where not measured; "
                "for times also moments such as 2026-03-01T10:00:00.5Z",
            )
        if "straddling" in message or "block" in message.lower():
            return LogError(where, f"a line after row {row} is too long", accepted=ACCEPTED)
        return LogError(where, f"breaks off or is damaged after row {row - 1}", accepted=ACCEPTED)


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
    cells = pc.fill_null(pc.cast(column, pa.float64(), safe=False), np.nan)
    return np.array(cells.to_numpy(zero_copy_only=False), dtype=np.float64)


def _codes(column: Any) -> tuple[Integers, list[str]]:
    if pa.types.is_dictionary(column.type):
        column = pc.cast(column, column.type.value_type)
    if not pa.types.is_string(column.type):
        column = pc.cast(column, pa.string())
    encoded = column.dictionary_encode()
    codes = pc.fill_null(encoded.indices, -1).to_numpy(zero_copy_only=False).astype(np.int64)
    return codes, [str(label).strip() for label in encoded.dictionary.to_pylist()]
