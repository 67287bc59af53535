"""Files that a session is exported to, by the ending of their name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tomoskin.core import FloatArray, StrPath, registered
from tomoskin.files.exports.export import Export, ExportFormat
from tomoskin.files.exports.matlab_file import write_matlab
from tomoskin.files.exports.picture import FILMS, MOST_PANELS, rendered, write_picture
from tomoskin.files.exports.session_table import (
    write_csv,
    write_deformations,
    write_hdf5,
    write_parquet,
    write_touches,
)
from tomoskin.files.exports.vtu import write_series
from tomoskin.files.imports import write_interchange
from tomoskin.files.messages import Contacts
from tomoskin.files.session import (
    OWN_FILES,
    SessionReader,
    first_scan,
    message_counts,
    recording_of,
    session_deformations,
    session_touches,
)
from tomoskin.learning import DEPTH, dent_map
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, colour_limit
from tomoskin.sensing.track import measured_in


def _npz(job: Export, path: StrPath) -> None:
    write_interchange(path, recording_of(job.session), overwrite=job.overwrite)


def _matlab(job: Export, path: StrPath) -> None:
    skin, recording = job.session.skin, recording_of(job.session)
    write_matlab(path, recording, skin.current, skin.n_electrodes, overwrite=job.overwrite)


def _series(job: Export, path: StrPath) -> None:
    moments = ((result.host_time, fields_of(job, result)) for result in job.images())
    listing = Path(path).with_suffix(".pvd")
    write_series(listing, job.prepared.mesh, moments, overwrite=job.overwrite)


def fields_of(job: Export, result: FrameResult) -> dict[str, FloatArray]:
    """The image, and the dent of touches whose depths a calibration tells."""
    fields, (skin, mesh) = {"change": result.image.values}, (job.session.skin, job.prepared.mesh)
    if DEPTH.name in job.prepared.calibrations and skin.layer is not None:
        touches = [touch.detection for touch in result.touches]
        if (dent := dent_map(touches, mesh.centroids[:, :2], skin.layer)) is not None:
            fields |= {"deflection_m": dent.deflection, "deflection_sd_m": dent.deviation}
    return fields


def _film(job: Export, path: StrPath) -> None:
    mesh, unit, limit = _scale(job)
    pictures = (rendered(path, mesh, panel, unit, limit) for panel in job.panels())
    FILMS[Path(path).suffix.lower()](path, pictures, 1.0 / job.every, overwrite=job.overwrite)


def _picture(job: Export, path: StrPath) -> None:
    """A sheet of maps, evenly spread over the session."""
    panels, (mesh, unit, limit) = list(job.panels()), _scale(job)
    chosen = np.linspace(0, len(panels) - 1, min(len(panels), MOST_PANELS)).round()
    some = [panels[int(number)] for number in np.unique(chosen)]
    write_picture(path, mesh, some, unit, limit, overwrite=job.overwrite)


def _scale(job: Export) -> tuple[Mesh, str, float]:
    """The mesh, and the unit and end of the colour scale."""
    return job.prepared.mesh, job.prepared.operator.unit, colour_limit(job.prepared)


def export_touches(job: Export, path: StrPath) -> None:
    """Write a table of the touches; of a session without any, those that a replay finds.

    Where the robot is known that wore the skin, it says which are the robot's own. Raises
    DataError where the session is too short for a reference, so that none could be told.
    """
    rows, own = list(session_touches(job.session)), None
    if not rows:
        next(job.images())
    if job.robot is not None:
        frames = [Contacts(job.stream, -1, time, True, None, None, t).kept() for _, time, t in rows]
        rows = [(*row[:2], frame.tracked) for row, frame in zip(rows, frames, strict=True)]
        own = [contact.is_self for frame in frames for contact in frame.touches]
    write_touches(
        path,
        rows,
        job.session.skin.surface,
        measured=measured_in(rows),
        begun=first_scan(job.session),
        own=own,
        overwrite=job.overwrite,
    )


def export_deformations(job: Export, path: StrPath) -> None:
    """Write a table of how the sheet is deformed; of a session without touches and images, as a
    replay finds."""
    write_deformations(path, session_deformations(job.session), overwrite=job.overwrite)


WRITERS: dict[str, Callable[[Export, Path], None]] = {
    ".csv": write_csv,
    ".parquet": write_parquet,
    ".h5": write_hdf5,
    ".npz": _npz,
    ".mat": _matlab,
    **dict.fromkeys((".vtu", ".pvd"), _series),
    ".png": _picture,
    **dict.fromkeys(FILMS, _film),
}
"""What writes a file of our own formats, by the ending of its name."""


def export_formats() -> dict[str, ExportFormat]:
    """Our own formats and those that are registered, by the ending of a file's name."""
    ours = {ending: ExportFormat(write) for ending, write in WRITERS.items()}
    return ours | {ending: entry.load() for ending, entry in registered("exports").items()}


_TABLES = (".csv", ".parquet", ".npz", ".mat")
"""Files of voltages."""

_SESSION_ONLY = {
    "/touches": "the touches (--touches X.csv)",
    "/events": "events",
    "/notes": "notes",
}
"""What only a session or a .h5 holds, by the topic of its messages."""


def omitted(session: SessionReader, ending: str) -> tuple[str, ...]:
    """What of ``session`` a file of that ``ending`` does not hold, in words."""
    if ending not in _TABLES:
        return ()
    name = session.skin.name
    skin = f"the skin (--skin {name if name in Skin.names() else 'with its file'})"
    counts = message_counts(session)
    extras = [words for topic, words in _SESSION_ONLY.items() if counts[topic]]
    return skin, *extras, *(name for name in session.attachments() if name not in OWN_FILES)
