"""Everything of a session in one HDF5 file (extra ``hdf5``)."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

from tomoskin.core import StrPath, needed, written
from tomoskin.files.session import Advance, Block, Rows, SessionReader, all_blocks, session_touches
from tomoskin.sensing.track import force_values

_FRAMES = ("number", "time", "host_time", "sequence", "ticks", "mark", "samples", "voltages")
_TOUCH = np.dtype(
    [("frame", "i8"), ("time", "f8"), ("id", "i8"), ("kind", "S32"), ("since", "f8")]
    + [(name, "f8") for name in ("x", "y", "sd_x", "sd_y", "area", "peak")]
    + [("force", "f8"), ("force_low", "f8"), ("force_high", "f8"), ("force_state", "S12")]
)


def write_hdf5(
    path: StrPath, session: SessionReader, advance: Advance, *, overwrite: bool = False
) -> None:
    """Groups ``frames`` (one dataset a column), ``touches``, ``truth`` and ``events``.

    ``drive`` and ``measure`` (n_meas, 2) beside them; the skin file, device and settings are
    attributes.

    Raises
    ------
    DataError
        When h5py is missing or the session is damaged, and as :func:`written` does.
    """
    h5py = needed("h5py", "hdf5", path)
    rows = Rows.of(session)
    with written(path, overwrite=overwrite) as part, h5py.File(part, "w") as file:
        file.attrs["skin"] = session.skin.to_toml()
        file.attrs["epoch_s"] = session.epoch
        file.attrs["device"] = _json(session.device())
        file.attrs["settings"] = _json(session.settings())
        file["drive"], file["measure"] = rows.pattern.drive, rows.pattern.measure
        group = file.create_group("frames")
        for block in all_blocks(session, rows, advance):
            _append(group, block)
        file["touches"] = _touches(session)
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
         r.x, r.y, r.sd_x, r.sd_y, r.area, r.peak, *force_values(r.force))
        for frame, time, touches in session_touches(session)
        for t in touches
        for r in [t.detection]
    ]  # fmt: skip
    return np.array(table, dtype=_TOUCH)


def _json(item: Any) -> str:
    return msgspec.json.encode(item).decode()
