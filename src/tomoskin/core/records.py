"""The frozen records that travel from bytes to touches.

SI units throughout; electrodes, measurements and cells are counted from 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntFlag
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tomoskin.core.errors import DataError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One scan as the device sent it.

    Attributes
    ----------
    sequence
        The device's frame counter, modulo 2³².
    ticks
        Device clock at the start of the scan, in ticks (rate in the device's INFO).
    host_time
        Host monotonic seconds at which the frame's last byte was read.
    configuration
        Identity of the scan configuration that produced the samples.
    flags
        Bit field, see the protocol's schema.
    drops
        Frames that the device itself has dropped since START.
    samples
        (n_samples,) raw counts in scan order, each the sum over the oversampling; of an alternating
        drive those in one direction less those in the other, plus 32,768.
    sums
        (n_samples,) of an alternating drive those in both directions together; else None.
    """

    sequence: int
    ticks: int
    host_time: float
    configuration: int
    flags: int
    drops: int
    samples: NDArray[np.uint16]
    sums: NDArray[np.uint16] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class DriveSamples:
    """One drive as the device sent it, while the scan goes on.

    The drives of a full turn make the same :class:`Frame` as a scan that is sent whole.

    Attributes
    ----------
    sequence
        Number of the turn through the order since START, modulo 2³²: every turn counts, full or
        not. A frame has the number of its turn.
    ticks
        Device clock at the start of the drive; of the first drive of a turn, at the start of the
        scan.
    host_time
        Host monotonic seconds at which the last byte was read.
    configuration, flags, drops
        As in :class:`Frame`; the same in all drives of a turn.
    order
        Identity of the order that the host has asked for; 0: full turns, drive by drive.
    place
        Of the drive in its order, from 0.
    drive
        Number of the drive in the configuration, from 0: its row of ``Scan.drives``.
    samples, sums
        As in :class:`Frame`, of this drive alone.
    """

    sequence: int
    ticks: int
    host_time: float
    configuration: int
    flags: int
    drops: int
    order: int
    place: int
    drive: int
    samples: NDArray[np.uint16]
    sums: NDArray[np.uint16] | None = None


class Mark(IntFlag):
    """What became of a frame on its way to the pipeline."""

    NONE = 0
    REFERENCE = 1
    """A new reference begins with this frame."""
    HELD = 2
    """Left out: the image was held."""
    SKIPPED = 4
    """Left out: too many frames waited."""
    OPENED = 8
    """First frame since the source was opened."""
    EARLIER = 16
    """From before the recording began: what its reference and operator were made of."""


@dataclass(frozen=True, slots=True, eq=False)
class MarkedFrame:
    """A frame, and what became of it."""

    frame: Frame
    mark: Mark


@dataclass(frozen=True, slots=True, eq=False)
class Voltages:
    """One frame in volts.

    Attributes
    ----------
    values
        (n_meas,) V, in the order of the pattern.
    excluded
        (n_meas,) bool: at a rail of the converter, or not finite.
    time, host_time
        s, of the device's clock and of the host's: host times of frames that were read together
        are the same.
    scanned, scan_time
        Middle of the scan by the host's clock, and how long it took, s; NaN where nothing tells.
    sequence
        The frame's number.
    samples
        What the board sent, where there is a board.
    own
        (n_electrodes,) V that each electrode shows whatever the current does, against their mean;
        None where the drive does not alternate.
    """

    values: FloatArray
    excluded: NDArray[np.bool_]
    time: float
    host_time: float
    sequence: int = 0
    samples: NDArray[np.uint16] | None = None
    own: FloatArray | None = None
    scanned: float = math.nan
    scan_time: float = math.nan


@dataclass(frozen=True, slots=True, eq=False)
class PixelMap:
    """A raster over a mesh; a pixel belongs to the cell that its centre lies in.

    Attributes
    ----------
    cells
        (h, w) cell of each pixel, −1 outside the mesh; row 0 is at the top (greatest y).
    x, y
        (w,) and (h,) centres of the columns and of the rows, m.
    mesh_id
        ``Mesh.identity`` of the mesh.
    """

    cells: IntArray
    x: FloatArray
    y: FloatArray
    mesh_id: str

    def spread(self, values: FloatArray) -> FloatArray:
        """(h, w) of ``values`` (n_cells,), NaN outside."""
        return np.asarray(np.where(self.cells >= 0, values[self.cells], np.nan))


@dataclass(frozen=True, slots=True, eq=False)
class Image:
    """A change of conductivity per cell.

    ``values`` is (n_cells,) in ``unit``: "S" (sheet), "S/m" (volume) or "relative" (Δσ/σ₀);
    (n, n_cells) where many frames were imaged at once.
    ``mesh_id`` names the mesh that the values live on (``Mesh.identity``). Images of complex
    data are complex: conductivity, and ω times permittivity.
    """

    values: FloatArray
    unit: str
    mesh_id: str

    @property
    def real(self) -> Image:
        """The change of conductivity alone."""
        return Image(self.values.real, self.unit, self.mesh_id)

    @property
    def imag(self) -> Image:
        """The change of ω times permittivity alone."""
        return Image(self.values.imag, self.unit, self.mesh_id)

    def on_pixels(self, pixels: PixelMap) -> FloatArray:
        """(h, w) values on a raster of the same mesh, NaN outside.

        Raises
        ------
        DataError
            When the raster was made for another mesh.
        """
        if pixels.mesh_id != self.mesh_id:
            raise DataError(
                f"the image belongs to mesh {self.mesh_id}, the pixels to mesh {pixels.mesh_id}",
                hint="make the pixels from the mesh that the image was made on",
            )
        return pixels.spread(self.values)


class DeferredImage(Image):
    """An image whose values are computed when they are first asked for, in the thread that asks."""

    def __init__(self, make: Callable[[], FloatArray], unit: str, mesh_id: str) -> None:
        """``make`` returns the values, always the same."""
        vars(self)["_make"] = make
        for name, value in {"unit": unit, "mesh_id": mesh_id}.items():
            object.__setattr__(self, name, value)

    @cached_property
    def values(self) -> FloatArray:
        """(n_cells,) see :class:`Image`."""
        made: FloatArray = vars(self)["_make"]()
        return made

    def __reduce__(self) -> tuple[type[Image], tuple[FloatArray, str, str]]:
        """What is pickled is a plain image: what makes it stays here."""
        return Image, (self.values, self.unit, self.mesh_id)


MEASURANDS: Mapping[str, str] = MappingProxyType({"force": "N", "depth": "m"})
"""What calibrations tell of a touch, by the name of its field in a :class:`Detection`: its unit."""


@dataclass(frozen=True, slots=True)
class Amount:
    """The force of a touch across the sheet, N, or its depth, m: median, and an interval that nine
    in ten lie in.

    ``high`` is infinite where the amount is beyond those that were taught.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """One region of an image, before it is tracked.

    Attributes
    ----------
    x, y
        Weighted centroid, m.
    sd_x, sd_y
        Standard deviation of the centroid, m; NaN where the noise is not known.
    area
        Area of the region, m².
    peak
        Extreme value of the image in the region, signed, in the image's unit.
    cells
        (n,) indices of the region's cells.
    cov_xy
        Covariance of ``x`` and ``y``, m², beside the squares of ``sd_x`` and ``sd_y``.
    snr
        How many times its noise the detection stands out; NaN where the noise is not known.
    close
        Whether it may be several touches, too close to separate.
    weak
        Whether it is too weak beside others to be a touch by itself: it may carry one on.
    bias
        Standard deviation, along each axis, of what the position is off by without any noise, m;
        0 in a touch, whose ``sd_x`` and ``sd_y`` hold it.
    lasting
        (xx, xy, yy) m², the part of the covariance that is the same in frame after frame, so that
        no mean over frames takes it away: what a model errs by, and slow noise. None where that is
        not known: then none of it may be taken away.
    force, depth
        N across the sheet, and m by which it gives way under the tip, with their intervals; None
        where no calibration tells them: uncalibrated.
    """

    x: float
    y: float
    sd_x: float
    sd_y: float
    area: float
    peak: float
    cells: IntArray
    cov_xy: float = 0.0
    snr: float = math.nan
    close: bool = False
    weak: bool = False
    bias: float = 0.0
    lasting: tuple[float, float, float] | None = None
    force: Amount | None = None
    depth: Amount | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Touch:
    """A tracked region: a detection with an identity that lasts from onset to release.

    Attributes
    ----------
    id
        From 1 on; never given twice.
    kind
        "decrease" or "increase", by the sign of its peak.
    since
        Host monotonic seconds of its first frame.
    detection
        The newest.
    merged
        Identities of all the touches that it stands for, its own among them, where several have
        come too close to separate; else empty.
    possible
        Identities that it may have, its own among them, where it has been too close to another
        for frames to tell who is who; else empty.
    elsewhere
        Other places, (x, y) m, at which the same press gives the same voltages, where the skin's
        pattern cannot tell them apart; else empty.
    provisional
        Whether single drives alone have told of it: no frame has confirmed it yet.
    """

    id: int
    kind: str
    since: float
    detection: Detection = field(repr=False)
    merged: tuple[int, ...] = ()
    possible: tuple[int, ...] = ()
    provisional: bool = False
    elsewhere: tuple[tuple[float, float], ...] = ()

    @property
    def amounts(self) -> dict[str, Amount]:
        """What calibrations tell of it, by the names of :data:`MEASURANDS`."""
        values = {name: getattr(self.detection, name) for name in MEASURANDS}
        return {name: amount for name, amount in values.items() if amount is not None}

    @property
    def said(self) -> str:
        """Its kind for tables: "merged 1+2", "1 or 2" and "too close" say what is not certain, and
        so does "or at 50 30 mm", a place that the pattern cannot tell from its own."""
        places = [f"or at {1e3 * x:.0f} {1e3 * y:.0f} mm" for x, y in self.elsewhere]
        return ", ".join([self._who, *places])

    @property
    def _who(self) -> str:
        if self.merged:
            return f"merged {'+'.join(map(str, self.merged))}"
        if self.possible:
            return " or ".join(map(str, self.possible))
        return "too close" if self.detection.close else self.kind


@dataclass(frozen=True, slots=True)
class Event:
    """Something a person should know: a gap, a refused frame, a lost source.

    ``kind`` is a short stable word, ``text`` a sentence.
    """

    host_time: float
    kind: str
    text: str
