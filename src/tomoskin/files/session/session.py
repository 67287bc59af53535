"""A session file for those who compute with it: frame by frame, as a table, as arrays."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import StrPath
from tomoskin.files.session.blocks import read_session
from tomoskin.files.session.replayed import as_recorded, gathered, replayed, replaying
from tomoskin.files.session.session_reader import SessionReader
from tomoskin.model.mesh import Mesh
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.sensing.signal import Recording
from tomoskin.sensing.track import has_forces, touch_columns


class Session:
    """A recorded session; iterate over it for what the pipeline makes of each frame.

    Every loop begins at the first frame and gives the same results, those of the live run to the
    bit. Until the reference stands, ``ready`` of a frame is False. The file is open only while it
    is read.

    Parameters
    ----------
    path
        The file, such as "run.mcap".

    Attributes
    ----------
    path
        The file.
    skin
        The skin that it was recorded with.

    Raises
    ------
    DataError
        When the file cannot be read, is no session, or is damaged; from every method.
    """

    def __init__(self, path: StrPath) -> None:
        self.path = Path(path)
        with SessionReader(self.path) as reader:
            self.skin = reader.skin

    def __iter__(self) -> Iterator[FrameResult]:
        """Frame by frame: voltages, image, touches."""
        with SessionReader(self.path) as reader:
            yield from replayed(self.prepared, reader)

    @property
    def mesh(self) -> Mesh:
        """The mesh that the images live on."""
        return self.prepared.mesh

    @cached_property
    def prepared(self) -> Prepared:
        """What the pipeline needs of the skin and of the calibrations that were on."""
        with SessionReader(self.path) as reader:
            return as_recorded(reader)

    def voltages(self) -> Recording:
        """All frames at once, as voltages in the order of the skin's pattern."""
        return read_session(self.path)

    def touches(self) -> dict[str, NDArray[np.generic]]:
        """All touches as columns, one row a touch, as ``pandas.DataFrame`` takes them.

        The columns are those of :func:`tomoskin.sensing.track.touch_columns`.
        """
        with SessionReader(self.path) as reader:
            pipeline = replaying(self.prepared, reader)
            frames = [
                (frame.number, frame.time, result.touches)
                for frame, result in gathered(pipeline, reader, self.prepared.scan)
                if result is not None
            ]
        return touch_columns(frames, self.skin.surface, forces=has_forces(frames))
