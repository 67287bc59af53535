"""Files that images are written to, by the ending of their name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tomoskin.core import DataError, save_arrays
from tomoskin.formats import MOST_PANELS, Display, Panel, write_picture, write_vtu
from tomoskin.pipeline import Prepared, Reconstruction

_MOST_FIELDS = 200


def png(
    path: Path, prepared: Prepared, found: Reconstruction, display: Display, *, overwrite: bool
) -> None:
    """Draw all frames, or as many as fit, evenly spread over the recording."""
    n = len(found.frames)
    chosen = np.unique(np.linspace(0, n - 1, min(n, MOST_PANELS)).round().astype(int))
    images, unit = display.applied(found.images[chosen], prepared.mesh, found.unit)
    panels = [
        Panel(f"frame {found.frames[i]}", image, found.touches[i])
        for i, image in zip(chosen, images, strict=True)
    ]
    write_picture(path, prepared.mesh, panels, unit, display.limit, overwrite=overwrite)


def npz(
    path: Path, prepared: Prepared, found: Reconstruction, display: Display, *, overwrite: bool
) -> None:
    """Write images (n_frames, n_cells) with their mesh."""
    images, unit = display.applied(found.images, prepared.mesh, found.unit)
    arrays = {
        "images": images,
        "frames": found.frames,
        "unit": np.array(unit),
        "smoothing_m": np.array(display.smoothing),
        "mesh_id": np.array(prepared.mesh.identity),
        "points": prepared.mesh.points,
        "cells": prepared.mesh.cells,
    }
    save_arrays(path, arrays, overwrite=overwrite)


def vtu(
    path: Path, prepared: Prepared, found: Reconstruction, display: Display, *, overwrite: bool
) -> None:
    """Write one cell field a frame."""
    if len(found.frames) > _MOST_FIELDS:
        raise DataError(
            f"a .vtu file takes {_MOST_FIELDS} frames, got {len(found.frames)}",
            where=str(path),
            hint="choose some with --frames A:B",
        )
    images, _ = display.applied(found.images, prepared.mesh, found.unit)
    names = [f"frame_{frame:06d}" for frame in found.frames.tolist()]
    write_vtu(path, prepared.mesh, dict(zip(names, images, strict=True)), overwrite=overwrite)


WRITERS = {".png": png, ".npz": npz, ".vtu": vtu}
