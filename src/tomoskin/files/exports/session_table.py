"""Voltages and touches of a session as tables, .csv or .parquet, block by block; and everything of
it in one HDF5 file (extra ``hdf5``)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from tomoskin.core import MEASURANDS, StrPath, needed, write_rows, written
from tomoskin.files.exports.export import Export
from tomoskin.files.imports import column_names
from tomoskin.files.messages import DEFORMATION_COLUMNS, DeformedFrame, deformation_rows
from tomoskin.files.session import (
    Block,
    SessionReader,
    all_blocks,
    idle_count,
    press_positions,
    session_deformations,
    session_touches,
)
from tomoskin.model.mesh import Surface
from tomoskin.sensing.track import (
    ELAPSED,
    Measurands,
    TouchedFrame,
    amount_values,
    columns_of,
    touch_rows,
)

Column = NDArray[Any]


class _FrameColumns:
    """Columns beside the voltages; ``x_m`` and ``y_m`` where the file holds truth."""

    def __init__(self, session: SessionReader) -> None:
        self._idle = idle_count(session)
        self._positions = press_positions(session)
        place = ("x_m", "y_m") if self._positions else ()
        self.names = ("frame", "time_s", "sequence", "ticks", "mark", "idle", *place)

    def __call__(self, block: Block) -> tuple[Column, ...]:
        """Of one block, in the order of the names."""
        place = self._positions(block).T if self._positions else ()
        idle = (block.number < self._idle).astype(np.int64)
        return block.number, block.time, block.sequence, block.ticks, block.mark, idle, *place


def write_csv(job: Export, path: StrPath) -> None:
    """One line a frame, in the interchange table's columns: ``tomoskin image`` reads it again.

    Raises
    ------
    DataError
        When the session is damaged, and as :func:`written` does.
    """
    pattern, columns_of = job.session.skin.pattern(), _FrameColumns(job.session)
    names = column_names(pattern.drive, pattern.measure)
    with (
        written(path, overwrite=job.overwrite) as part,
        part.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(",".join([*columns_of.names, *names]) + "\n")
        for block in all_blocks(job.session, job.advance):
            columns = [column.tolist() for column in columns_of(block)]
            for *first, voltages in zip(*columns, block.voltages.tolist(), strict=True):
                file.write(",".join(map(_text, [*first, *voltages])) + "\n")


def write_parquet(job: Export, path: StrPath) -> None:
    """One row a frame: the columns beside, and ``voltages`` as a list of floats.

    The tables ``drive`` and ``measure`` are JSON in the schema's metadata, with the skin.

    Raises
    ------
    DataError
        When pyarrow is missing or the session is damaged, and as :func:`written` does.
    """
    pa, pq = (needed(name, "parquet", path) for name in ("pyarrow", "pyarrow.parquet"))
    pattern, columns_of = job.session.skin.pattern(), _FrameColumns(job.session)
    kinds = {"time_s": pa.float64(), "ticks": pa.uint64(), "x_m": pa.float64(), "y_m": pa.float64()}
    fields = [pa.field(name, kinds.get(name, pa.int64())) for name in columns_of.names]
    fields.append(pa.field("voltages", pa.list_(pa.float64(), pattern.n_meas)))
    schema = pa.schema(fields, metadata=_about(job.session))
    with (
        written(path, overwrite=job.overwrite) as part,
        pq.ParquetWriter(part, schema, compression="zstd") as file,
    ):
        for block in all_blocks(job.session, job.advance):
            flat = pa.array(block.voltages.reshape(-1))
            values = pa.FixedSizeListArray.from_arrays(flat, pattern.n_meas)
            arrays = [pa.array(column) for column in columns_of(block)]
            file.write_batch(pa.record_batch([*arrays, values], schema=schema))


def _text(value: float) -> str:
    return "" if math.isnan(value) else repr(value)


def _about(session: SessionReader) -> dict[str, str]:
    pattern = session.skin.pattern()
    tables = {"drive": pattern.drive.tolist(), "measure": pattern.measure.tolist()}
    written = {name: msgspec.json.encode(table).decode() for name, table in tables.items()}
    return written | {"skin": session.skin.to_toml(), "epoch_s": repr(session.epoch)}


def write_touches(
    path: StrPath,
    frames: Iterable[TouchedFrame],
    surface: Surface | None = None,
    *,
    measured: Measurands = (),
    begun: float | None = None,
    own: Sequence[bool | None] | None = None,
    overwrite: bool = False,
) -> int:
    """Write touches of (frame, time, touches); return the number of rows.

    A frame is its index in the recording, from 0, and empty where that does not hold it; its time
    is the recording's own.

    ``measured`` adds columns of forces or depths, empty where a touch has none; ``begun``, the
    time of the recording's own first frame, adds the time since then; ``own``, of every row, adds
    whether a link of the robot itself touched, empty where that is not known.

    A standard deviation that is not known is an empty field; the kind is :attr:`Touch.said`. On
    a ``surface`` that is not flat each row ends with the touch's position on it.

    Raises as :func:`written` does.
    """
    names = columns_of(surface, measured=measured, begun=begun)
    rows: list[list[str]] = []
    for row in touch_rows(frames, surface, measured=measured, begun=begun):
        rows.append([_touch_text(name, value) for name, value in zip(names, row, strict=True)])
    if own is not None:
        names = *names, "self"
        for texts, mark in zip(rows, own, strict=True):
            texts.append("" if mark is None else str(mark).lower())
    write_rows(path, [names, *rows], overwrite=overwrite)
    return len(rows)


def write_deformations(
    path: StrPath, frames: Iterable[DeformedFrame], *, overwrite: bool = False
) -> int:
    """Write how the sheet is deformed in (frame, time, deformation); return the number of rows.

    One row a frame that is told as deformed, in :data:`~.messages.DEFORMATION_COLUMNS`; what is not
    known is an empty field. Raises as :func:`written` does.
    """
    rows = [[*map(_touch_text, DEFORMATION_COLUMNS, row)] for row in deformation_rows(frames)]
    write_rows(path, [DEFORMATION_COLUMNS, *rows], overwrite=overwrite)
    return len(rows)


def _touch_text(name: str, value: object) -> str:
    if name in ("time_s", ELAPSED):
        return f"{value:.6f}"
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return "" if name == "frame" and value == -1 else str(value)


_FRAMES = ("number", "time", "host_time", "sequence", "ticks", "mark", "samples", "voltages")
_TOUCH = np.dtype(
    [("frame", "i8"), ("time", "f8"), ("id", "i8"), ("kind", "S80"), ("since", "f8")]
    + [(name, "f8") for name in ("x", "y", "sd_x", "sd_y", "area", "peak")]
    + [
        (f"{name}{part}", "S12" if part == "_state" else "f8")
        for name in MEASURANDS
        for part in ("", "_low", "_high", "_state")
    ]
)

_TEXTS = {"frame": "i8", "kind": "S8", "unit": "S8", "confused": "S128"}
_DEFORMATION = np.dtype([(name, _TEXTS.get(name, "f8")) for name in DEFORMATION_COLUMNS])


def write_hdf5(job: Export, path: StrPath) -> None:
    """Groups ``frames`` (one dataset a column), ``touches``, ``deformations``, ``truth`` and
    ``events``.

    ``drive`` and ``measure`` (n_meas, 2) beside them; the skin file, device and settings are
    attributes.

    Raises
    ------
    DataError
        When h5py is missing or the session is damaged, and as :func:`written` does.
    """
    session = job.session
    h5py = needed("h5py", "hdf5", path)
    with written(path, overwrite=job.overwrite) as part, h5py.File(part, "w") as file:
        file.attrs["skin"] = session.skin.to_toml()
        file.attrs["epoch_s"] = session.epoch
        file.attrs["device"] = _json(session.device())
        file.attrs["settings"] = _json(session.settings())
        pattern = session.skin.pattern()
        file["drive"], file["measure"] = pattern.drive, pattern.measure
        group = file.create_group("frames")
        for block in all_blocks(session, job.advance):
            _append(group, block)
        file["touches"] = _touches(session)
        rows = list(deformation_rows(session_deformations(session)))
        file["deformations"] = np.array([_encoded(row) for row in rows], dtype=_DEFORMATION)
        text = h5py.string_dtype()
        for name, items in (("truth", session.truth()), ("events", session.events())):
            lines = [_json(item) for item in items]
            file.create_dataset(name, data=np.array(lines, dtype=object), dtype=text)


def _append(group: Any, block: Block) -> None:
    for name in _FRAMES:
        values = getattr(block, name)
        if name not in group:
            limits = (None, *values.shape[1:])
            group.create_dataset(name, data=values, maxshape=limits, chunks=True)
        else:
            dataset = group[name]
            dataset.resize(len(dataset) + len(values), axis=0)
            dataset[-len(values) :] = values


def _touches(session: SessionReader) -> Any:
    """By frame, as in every table; -1 where a touch's frame is not in the file."""
    table = [
        (-1 if frame is None else frame, time, t.id, t.said.encode(), t.since,
         r.x, r.y, r.sd_x, r.sd_y, r.area, r.peak,
         *amount_values(r.force), *amount_values(r.depth))
        for frame, time, touches in session_touches(session)
        for t in touches
        for r in [t.detection]
    ]  # fmt: skip
    return np.array(table, dtype=_TOUCH)


def _encoded(row: tuple[Any, ...]) -> tuple[Any, ...]:
    return tuple(value.encode() if isinstance(value, str) else value for value in row)


def _json(item: Any) -> str:
    return msgspec.json.encode(item).decode()
