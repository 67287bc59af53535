"""Many frames at once: usable measurements become images, the rest is excluded and named."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, Image, IntArray
from tomoskin.imaging.linear.operator import Operator
from tomoskin.model.pattern import Pattern

MOST_EXCLUDED = 0.25
"""Above this fraction of excluded measurements a frame gives no image: mostly prior."""

_LISTED = 5


@dataclass(frozen=True, eq=False)
class ImageSeries:
    """Images of frames.

    Attributes
    ----------
    values
        (n_images, n_cells) in ``unit``.
    frames
        (n_images,) the frames that gave them.
    dropped
        (n_dropped,) measurements excluded in most frames, and so in all.
    left_out
        (n_frames, n_meas) bool: the measurements of each frame that were excluded.
    pattern
        Whose rows these are.
    unit, mesh_id
        As in :class:`Image`.
    """

    values: NDArray[Any]
    frames: IntArray
    dropped: IntArray
    left_out: NDArray[np.bool_]
    pattern: Pattern
    unit: str
    mesh_id: str

    def image(self, index: int) -> Image:
        """The image of frame ``frames[index]``."""
        return Image(self.values[index], self.unit, self.mesh_id)

    @property
    def report(self) -> str:
        """What was excluded, in words; empty where everything was used."""
        parts = []
        if len(self.dropped):
            listed = "; ".join(self.pattern.row_text(row) for row in self.dropped[:_LISTED])
            more = len(self.dropped) - _LISTED
            parts.append(f"rows left out: {listed}{f'; and {more} more' if more > 0 else ''}")
        others = np.delete(self.left_out, self.dropped, axis=1)[self.frames].any(axis=1)
        if others.any():
            parts.append(f"{int(others.sum())} frames lack further rows")
        none = len(self.left_out) - len(self.frames)
        if none:
            parts.append(f"{none} frames lack too many rows and give no image")
        return "; ".join(parts)


def image_series(
    operator: Operator,
    changes: NDArray[Any],
    pattern: Pattern,
    railed: NDArray[np.bool_] | None = None,
) -> ImageSeries:
    """Images of ``changes``, (n_frames, n_meas) difference data in the order of ``pattern``.

    A row that is not finite or ``railed``, (n_frames, n_meas) bool, in most frames leaves the
    operator; one that is so now and then is filled in. Either way it is excluded.

    Raises
    ------
    DataError
        When the data are of another pattern or shape, or no frame has rows enough.
    """
    operator.accept(pattern)
    if changes.ndim != 2 or changes.shape[1] != pattern.n_meas or not len(changes):
        raise DataError(f"expected changes (n_frames, {pattern.n_meas}), got {changes.shape}")
    excluded = ~np.isfinite(changes)
    if railed is not None:
        excluded |= railed
    dropped = np.flatnonzero(excluded.mean(axis=0) > 0.5)
    excluded[:, dropped] = True
    frames = np.flatnonzero(excluded.mean(axis=1) <= MOST_EXCLUDED)
    if not len(frames):
        raise DataError(
            f"no frame has {1 - MOST_EXCLUDED:.0%} of its rows; most frames lack "
            + "; ".join(pattern.row_text(row) for row in dropped[:_LISTED])
        )
    fewer = operator.without(dropped)
    used = [fewer.check(fewer.filled(changes[f], excluded[f])) for f in frames]
    return ImageSeries(
        values=np.stack(used) @ fewer.matrix.T,
        frames=frames,
        dropped=dropped,
        left_out=excluded,
        pattern=pattern,
        unit=operator.unit,
        mesh_id=operator.model.mesh.identity,
    )
