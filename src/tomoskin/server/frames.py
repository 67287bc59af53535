"""The binary message: one result for one page, little-endian, every section 4-byte aligned.

====================  ======================================================================
header, 40 bytes      ``TSK1``, sequence u32, host_time f64, n_cells u32, n_meas u32,
                      n_touches u16, n_truth u16, flags u32, latency_us u32, n_dent u32
image                 f32 [n_cells], change of conductivity in the scene's unit
voltages, reference   f32 [n_meas] each, V
touches, 64 bytes     id u32, kind u8 (0 decrease, 1 increase), several u8 (0 no, 1 may be
each                  several, n > 1: n that have merged), own u8 (1: a link of the robot
                      itself makes it), provisional u8 (1: no whole scan has confirmed it), x,
                      y, sd_x, sd_y (NaN unknown), area, peak, since (s ago), cov_xy (m²), force
                      and its interval (N), depth and its interval (m; NaN uncalibrated) f32
truth, 16 bytes each  x, y (m), force (N), radius (m) f32: the presses on the twin
labels                u8 [n_cells], 0 none, k = cells of the k-th touch; padded to 4 bytes
dent                  u16 [n_dent] twice: by how much each node of the mesh has given way, and the
                      deviation of that, in :data:`DENT_STEP`; n_dent is 0 where none is asked for
readings              all bytes that follow: JSON, what the page shows of what calibrations read,
                      by its key, and how the sheet is deformed as "deformation"; none where
                      nothing was read and it is not
====================  ======================================================================

Flags: bit 0 the reference stands; bit 1 too many rows are unusable, there is no image;
bit 2 some rows are left out of the image.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from enum import IntFlag
from typing import Any

import numpy as np

from tomoskin.core import Touch, encode_json
from tomoskin.files.messages import deformation_content
from tomoskin.learning import DentMap
from tomoskin.pipeline import FrameResult
from tomoskin.sensing.track import amount_values
from tomoskin.twin import Probe

MAGIC = b"TSK1"


class Flag(IntFlag):
    """The bits of the flags in a frame's header."""

    READY = 1
    NO_IMAGE = 2
    ROWS_LEFT_OUT = 4


DENT_STEP = 2e-6
"""Metres by which a dent is counted: a page has up to 131 mm."""

_OF_DETECTION = ("x", "y", "sd_x", "sd_y", "area", "peak")
_MEASURES = (
    *_OF_DETECTION,
    *("since", "cov_xy"),
    *("force", "force_low", "force_high", "depth", "depth_low", "depth_high"),
)
RECORDS = {
    "Header": np.dtype(
        [
            ("magic", "S4"),
            ("sequence", "<u4"),
            ("host_time", "<f8"),
            ("n_cells", "<u4"),
            ("n_meas", "<u4"),
            ("n_touches", "<u2"),
            ("n_truth", "<u2"),
            ("flags", "<u4"),
            ("latency_us", "<u4"),
            ("n_dent", "<u4"),
        ]
    ),
    "Touch": np.dtype(
        [
            ("id", "<u4"),
            ("kind", "u1"),
            ("several", "u1"),
            ("own", "u1"),
            ("provisional", "u1"),
            *((name, "<f4") for name in _MEASURES),
        ]
    ),
    "Truth": np.dtype([(name, "<f4") for name in ("x", "y", "force", "radius")]),
}
"""The records of the message; ``scripts/page_types.py`` makes the page's readers of them."""

DEFORMATION = "deformation"
"""Key of how the sheet is deformed, beside those of readings."""

_MOST = 255
"""Labels are bytes: more touches than that are not sent."""


def encode_result(
    result: FrameResult,
    truth: Sequence[Probe],
    latency: float,
    dent: DentMap | None = None,
    own: Container[int] = (),
) -> bytes:
    """Message of one result.

    Parameters
    ----------
    result
        What the pipeline made of the frame.
    truth
        The twin's own presses when the frame was read; empty for a real skin.
    latency
        Seconds from the frame's last byte to its touches.
    dent
        The dent of its touches at the nodes of the mesh, where a page asks for it.
    own
        Identities of the touches that links of the robot itself make.
    """
    touches = result.touches[:_MOST]
    return b"".join(
        [
            _header(result, len(touches), len(truth), latency, dent),
            result.image.values.astype("<f4").tobytes(),
            result.voltages.astype("<f4").tobytes(),
            result.reference.astype("<f4").tobytes(),
            _touches(touches, result.host_time, own),
            _record("Truth", [(p.x, p.y, p.force, p.radius) for p in truth]),
            _labels(touches, len(result.image.values)),
            np.rint(np.minimum(np.array(dent or ()) / DENT_STEP, 65535)).astype("<u2").tobytes(),
            _readings(result),
        ]
    )


def _header(
    result: FrameResult, n_touches: int, n_truth: int, latency: float, dent: DentMap | None
) -> bytes:
    flags = Flag.READY * result.ready | Flag.NO_IMAGE * (not result.has_image)
    flags |= Flag.ROWS_LEFT_OUT * (result.left_out > 0)
    values = (
        MAGIC,
        result.sequence % 2**32,
        result.host_time,
        len(result.image.values),
        len(result.voltages),
        n_touches,
        n_truth,
        flags,
        min(max(round(latency * 1e6), 0), 2**32 - 1),
        0 if dent is None else len(dent.deflection),
    )
    return _record("Header", values)


def _record(name: str, values: object) -> bytes:
    return np.array(values, RECORDS[name]).tobytes()


def _touches(touches: Sequence[Touch], now: float, own: Container[int]) -> bytes:
    rows = [
        (
            t.id % 2**32,
            t.kind == "increase",
            min(len(t.merged), _MOST) or t.detection.close,
            t.id in own,
            t.provisional,
            *(getattr(t.detection, name) for name in _OF_DETECTION),
            now - t.since,
            t.detection.cov_xy,
            *amount_values(t.detection.force)[:3],
            *amount_values(t.detection.depth)[:3],
        )
        for t in touches
    ]
    return _record("Touch", rows)


def _readings(result: FrameResult) -> bytes:
    readings = result.shown_readings.values()
    shown: dict[str, Any] = {reading.key: reading.shown for reading in readings}
    if result.deformation is not None:
        shown[DEFORMATION] = deformation_content(result.deformation)
    return encode_json(shown) if shown else b""


def _labels(touches: Sequence[Touch], n_cells: int) -> bytes:
    labels = np.zeros(n_cells + -n_cells % 4, np.uint8)
    for number, touch in enumerate(touches, 1):
        labels[touch.detection.cells] = number
    return labels.tobytes()
