"""Files that a session is exported to, by the ending of their name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tomoskin.core import DataError, StrPath
from tomoskin.files.exports.bag import write_bag
from tomoskin.files.exports.lerobot import write_lerobot
from tomoskin.files.exports.matlab_file import write_matlab
from tomoskin.files.exports.picture import FILMS, MOST_PANELS, Panel, rendered, write_picture
from tomoskin.files.exports.rerun_file import write_rerun
from tomoskin.files.exports.session_table import write_csv, write_hdf5, write_parquet, write_touches
from tomoskin.files.exports.vtu import write_series
from tomoskin.files.imports import write_interchange
from tomoskin.files.messages import Every
from tomoskin.files.session import (
    OWN_FILES,
    Advance,
    SessionReader,
    as_recorded,
    first_scan,
    indexed_frames,
    message_counts,
    recording_of,
    replayed,
    session_touches,
)
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, colour_limit
from tomoskin.sensing.track import has_forces

if TYPE_CHECKING:
    from tomoskin.pipeline import FrameResult


@dataclass(frozen=True)
class Export:
    """A session to be exported.

    ``every`` s between two images; ``advance`` is called with how far it is. Files that are
    there are written over with ``overwrite`` only.
    """

    session: SessionReader
    every: float
    advance: Advance
    overwrite: bool = False

    def results(self, prepared: Prepared) -> Iterator[FrameResult]:
        """What a replay makes of each frame; ``advance`` is called as it goes."""
        total = indexed_frames(self.session)
        for done, result in enumerate(replayed(prepared, self.session)):
            self.advance(done, max(done + 1, total))
            yield result

    def npz(self, path: StrPath) -> None:
        """Write all frames as an interchange file."""
        write_interchange(path, recording_of(self.session), overwrite=self.overwrite)

    def matlab(self, path: StrPath) -> None:
        """Write all frames as EIDORS' structures."""
        skin = self.session.skin
        recording = recording_of(self.session)
        write_matlab(path, recording, skin.current, skin.n_electrodes, overwrite=self.overwrite)

    def series(self, path: StrPath) -> None:
        """Write a series of meshes with their images."""
        prepared = as_recorded(self.session)
        moments = ((r.host_time, r.image.values) for r in self._images(prepared))
        listing = Path(path).with_suffix(".pvd")
        write_series(listing, prepared.mesh, moments, overwrite=self.overwrite)

    def film(self, path: StrPath) -> None:
        """Write a film of the images with their touches."""
        prepared = as_recorded(self.session)
        unit, limit = prepared.operator.unit, colour_limit(prepared)
        pictures = (
            rendered(path, prepared.mesh, panel, unit, limit) for panel in self._panels(prepared)
        )
        write = FILMS[Path(path).suffix.lower()]
        write(path, pictures, 1.0 / self.every, overwrite=self.overwrite)

    def picture(self, path: StrPath) -> None:
        """Write a sheet of maps, evenly spread over the session."""
        prepared = as_recorded(self.session)
        panels = list(self._panels(prepared))
        chosen = np.linspace(0, len(panels) - 1, min(len(panels), MOST_PANELS)).round()
        some = [panels[int(number)] for number in np.unique(chosen)]
        unit, limit = prepared.operator.unit, colour_limit(prepared)
        write_picture(path, prepared.mesh, some, unit, limit, overwrite=self.overwrite)

    def touches(self, path: StrPath) -> None:
        """Write a table of the touches; of a session without any, those that a replay finds."""
        rows, surface = list(session_touches(self.session)), self.session.skin.surface
        forces = has_forces(rows)
        begun = first_scan(self.session)
        write_touches(path, rows, surface, forces=forces, begun=begun, overwrite=self.overwrite)

    def _panels(self, prepared: Prepared) -> Iterator[Panel]:
        first: float | None = None
        for result in self._images(prepared):
            first = result.host_time if first is None else first
            title = f"{result.host_time - first:.1f} s"
            yield Panel(title, result.image.values, result.touches)

    def _images(self, prepared: Prepared) -> Iterator[FrameResult]:
        """A result every so often; those before the reference stands are left out."""
        is_due, shown = Every(self.every), False
        for result in self.results(prepared):
            if result.ready and is_due(result.host_time):
                shown = True
                yield result
        if not shown:
            raise DataError(
                "holds too few frames for a reference, so there are no images",
                where=str(self.session.path),
            )


def _voltages(write: Callable[..., None]) -> Callable[[Export, Path], None]:
    """A writer that goes through the frames block by block."""
    return lambda job, path: write(path, job.session, job.advance, overwrite=job.overwrite)


WRITERS: dict[str, Callable[[Export, Path], None]] = {
    ".csv": _voltages(write_csv),
    ".parquet": _voltages(write_parquet),
    ".h5": _voltages(write_hdf5),
    ".lerobot": write_lerobot,
    ".npz": Export.npz,
    ".mat": Export.matlab,
    ".mcap": write_bag,
    ".rrd": write_rerun,
    ".vtu": Export.series,
    ".pvd": Export.series,
    ".png": Export.picture,
    ".gif": Export.film,
    ".mp4": Export.film,
}
"""What writes a file, by the ending of its name."""

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
