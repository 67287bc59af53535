"""Voltages of a session as a table, .csv or .parquet, block by block."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec

from tomoskin.core import DataError, written
from tomoskin.formats.imports.csv_table import column_names
from tomoskin.recording import Advance, Block, Rows, SessionReader, all_blocks

_BESIDE = ("frame", "time_s", "sequence", "ticks", "mark")


def write_csv(
    path: Path, session: SessionReader, advance: Advance, *, overwrite: bool = False
) -> None:
    """One line a frame, in the interchange table's columns: ``tomoskin image`` reads it again.

    Raises
    ------
    DataError
        When the session is damaged, and as :func:`written` does.
    """
    rows = Rows.of(session)
    names = column_names(rows.pattern.drive, rows.pattern.measure)
    with (
        written(path, overwrite=overwrite) as part,
        part.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(",".join([*_BESIDE, *names]) + "\n")
        for block in all_blocks(session, rows, advance):
            for number in range(len(block.number)):
                file.write(_line(block, number))


def write_parquet(
    path: Path, session: SessionReader, advance: Advance, *, overwrite: bool = False
) -> None:
    """One row a frame: frame, time_s, sequence, ticks, mark, and ``voltages`` as a list of floats.

    The tables ``drive`` and ``measure`` are JSON in the schema's metadata, with the skin.

    Raises
    ------
    DataError
        When pyarrow is missing or the session is damaged, and as :func:`written` does.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise DataError(
            "Parquet needs pyarrow", where=str(path), hint="pip install 'tomoskin[parquet]'"
        ) from error
    rows = Rows.of(session)
    n = rows.pattern.n_meas
    kinds = (pa.int64(), pa.float64(), pa.int64(), pa.uint64(), pa.int64())
    fields = [pa.field(name, kind) for name, kind in zip(_BESIDE, kinds, strict=True)]
    fields.append(pa.field("voltages", pa.list_(pa.float64(), n)))
    schema = pa.schema(fields, metadata=_about(session, rows))
    with (
        written(path, overwrite=overwrite) as part,
        pq.ParquetWriter(part, schema, compression="zstd") as file,
    ):
        for block in all_blocks(session, rows, advance):
            values = pa.FixedSizeListArray.from_arrays(pa.array(block.voltages.reshape(-1)), n)
            columns = [block.number, block.time, block.sequence, block.ticks, block.mark]
            arrays = [pa.array(column) for column in columns]
            file.write_batch(pa.record_batch([*arrays, values], schema=schema))


def _line(block: Block, number: int) -> str:
    beside = (
        f"{block.number[number]},{float(block.time[number])!r},{block.sequence[number]},"
        f"{block.ticks[number]},{block.mark[number]},"
    )
    values = ("" if math.isnan(value) else repr(value) for value in block.voltages[number].tolist())
    return beside + ",".join(values) + "\n"


def _about(session: SessionReader, rows: Rows) -> dict[str, str]:
    pattern = rows.pattern
    tables = {"drive": pattern.drive.tolist(), "measure": pattern.measure.tolist()}
    written = {name: msgspec.json.encode(table).decode() for name, table in tables.items()}
    return written | {"skin": session.skin.to_toml(), "epoch_s": repr(session.epoch)}
