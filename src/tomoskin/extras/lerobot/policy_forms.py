"""The forms in which policies take touch: a point set, a map, a vector and a window.

All values are finite, since one NaN spoils a training: what is not known is 0, and a field beside
it says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray, PixelMap, Touch
from tomoskin.files.messages import Contact, Contacts, Place, Stream
from tomoskin.pipeline import FrameResult, Prepared

SLOTS = 5
"""Touches that there is room for: as many as the fit tells apart."""

FIELDS = (
    *("valid", "present", "id", "x", "y", "z", "dx", "dy", "dz", "nx", "ny", "nz"),
    *("sd_x", "sd_y", "sd_z", "force_valid", "force", "strength"),
    *("depth_valid", "depth", "self_valid", "self"),
)
"""Columns of a slot; :meth:`Slots.table` says what they mean."""

POSE = ("valid", "x", "y", "z", "qx", "qy", "qz", "qw")
"""Where the link is that a skin lies on, in the root frame of the robot: 1 where that is known, m,
and a quaternion; zeros where it is not."""

UNKNOWN_SD = 1.0
"""Standard deviation of a position whose noise is not known, m: more than any sheet."""

_STALE, _PERIODS = 0.1, 3.0
"""Without a frame for so many seconds and periods, the newest touches no longer hold."""

_CM2 = 1e4
_MASK = NDArray[np.bool_]
_POSITION, _MOTION, _NORMAL = slice(3, 6), slice(6, 9), slice(9, 12)
_KNOWN = [FIELDS.index("present"), FIELDS.index("force_valid")]


@dataclass(frozen=True, eq=False)
class Slots:
    """The touches of one frame in fixed places: a touch keeps its place until it is released.

    Attributes
    ----------
    ids
        (SLOTS,) identity of the touch that has each place; 0 where it is free.
    onsets
        Where each of these touches began, by its identity, m.
    table
        (SLOTS, len(FIELDS)) see :data:`FIELDS`. ``valid`` is 1 where the skin can tell whether
        something touches, and ``present`` 1 where something does. ``x`` to ``nz`` are position,
        its change since the touch began, both along the surface, and normal in the frame of the
        contacts, m; ``force`` is in N against the normal, and ``force_valid`` 1 where it is
        calibrated; ``strength`` is in the image's unit; ``depth``, m, is as ``force``. ``self`` is
        1 where a link of the robot itself touches, and ``self_valid`` where that is known.
    """

    ids: tuple[int, ...] = (0,) * SLOTS
    onsets: Mapping[int, FloatArray] = field(default_factory=dict)
    table: FloatArray = field(default_factory=lambda: np.zeros((SLOTS, len(FIELDS))))

    def after(self, contacts: Contacts) -> Slots:
        """The slots of the next frame. While it is not valid, every touch keeps its place.

        Of merged touches all keep their places. One beyond :data:`SLOTS` waits for a free one.
        """
        table = np.zeros((SLOTS, len(FIELDS)))
        if not contacts.valid:
            return Slots(self.ids, self.onsets, table)
        ids = list(_kept(self.ids, contacts.tracked))
        onsets = {key: self.onsets[key] for key in ids if key}
        table[:, 0] = 1.0
        for contact in contacts.touches:
            key = contact.touch.id
            if key not in ids and 0 in ids:
                ids[ids.index(0)] = key
                onsets[key] = np.array(contact.position)
            if key in ids:
                table[ids.index(key), 1:] = _row(contact, onsets[key])
        return Slots(tuple(ids), onsets, table)


def pose_row(contacts: Contacts) -> list[float]:
    """The values of :data:`POSE`, in order."""
    pose = contacts.link and contacts.link.pose
    return [1.0, *pose.position, *pose.quaternion()] if pose else [0.0] * len(POSE)


def _kept(ids: tuple[int, ...], touches: tuple[Touch, ...]) -> tuple[int, ...]:
    alive = {key for touch in touches for key in (touch.id, *touch.merged)}
    return tuple(key if key in alive else 0 for key in ids)


def _row(contact: Contact, onset: FloatArray) -> list[float]:
    touch, position, spread = contact.touch, np.array(contact.position), contact.covariance
    deviation = [UNKNOWN_SD] * 3 if spread is None else np.sqrt(np.maximum(np.diag(spread), 0))
    force, depth = (
        (0.0, 0.0) if amount is None else (1.0, amount.value)
        for amount in (touch.detection.force, touch.detection.depth)
    )
    moved, own = position - onset, contact.is_self
    return [1.0, touch.id, *position, *moved, *contact.normal, *deviation, *force,
            touch.detection.peak, *depth, own is not None, bool(own)]  # fmt: skip


def last_before(times: FloatArray, moments: FloatArray, count: int) -> IntArray:
    """(n, count) indices of the last ``count`` of ``times`` at or before each moment, newest last.

    Where there are fewer the first stands for those that are missing.
    """
    newest = np.searchsorted(times, moments, side="right") - 1
    return np.asarray(np.maximum(newest[:, None] + np.arange(1 - count, 1), 0))


def still_holds(times: FloatArray, age: FloatArray) -> NDArray[np.bool_]:
    """Whether a frame of that age, s, still tells what touches, where frames come at ``times``."""
    period = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return np.asarray((age >= 0) & (age <= max(_STALE, _PERIODS * period)))


@dataclass(frozen=True, slots=True, eq=False)
class PolicyView:
    """Touch at one moment, in four forms.

    Attributes
    ----------
    valid
        Whether "no touch" means that nothing touches; where not, points and map are 0.
    time
        The moment on the host's clock, s.
    slots
        (SLOTS, len(FIELDS)) all that is known of each touch, see :class:`Slots`.
    points, point_mask
        (SLOTS, 9) position m, displacement m and force N in x, y, z; and (SLOTS, 2) whether there
        is a touch and whether its force is calibrated. Displacement is along the surface, since
        the touch began; the depth of an indentation is in ``slots``.
    map, map_mask, map_valid
        (size, size) N/cm², or change of conductance in the image's unit, the top row first; where
        the sheet is; and whether it shows all that touches: the forces of all touches are known.
    pose
        (len(POSE),) where the link of the robot is that the skin lies on, see :data:`POSE`.
    vector
        (n_meas,) change of the voltages in standard deviations of one frame's noise.
    window, ages
        (count, n_meas) V, change of the voltages in the last frames, newest last; and (count,) s,
        how long before the moment each was.
    """

    valid: bool
    time: float
    slots: FloatArray
    points: FloatArray
    point_mask: _MASK
    map: FloatArray
    map_mask: _MASK
    map_valid: bool
    pose: FloatArray
    vector: FloatArray
    window: FloatArray
    ages: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    contacts: Contacts
    slots: Slots
    change: FloatArray
    noise: FloatArray


class PolicyForms:
    """The four forms of a skin's touch, at the moments of a slower camera or controller.

    One thread pushes every frame, live or replayed; any other may ask.

    Parameters
    ----------
    prepared
        The skin.
    size
        Pixels along each side of the map.
    count
        Frames of the window: the frames between two moments, and one more, lose none.
    newtons
        Whether the map is of pressure, or of conductance.
    place
        Which of a robot's skins it is.

    Raises
    ------
    GeometryError
        When the sheet cannot be drawn on a plane.
    """

    def __init__(
        self,
        prepared: Prepared,
        *,
        size: int = 32,
        count: int = 6,
        newtons: bool = True,
        place: Place | None = None,
    ) -> None:
        self._stream = Stream.of(prepared, "", 0.0, place)
        self._grid = _Grid.of(prepared, size)
        self._count, self._newtons = count, newtons
        self._samples: tuple[_Sample, ...] = ()
        self._slots = Slots()

    def push(self, frame: FrameResult | Contacts) -> None:
        """Take the next frame, or that none comes; those before the reference are passed over."""
        contacts = frame if isinstance(frame, Contacts) else Contacts.of(self._stream, frame)
        change, noise = contacts.change, contacts.noise
        if change is None or noise is None:
            if not self._samples:
                return
            noise = self._samples[-1].noise  # no frame comes any more
            change = np.zeros_like(noise)
        self._slots = self._slots.after(contacts)
        sample = _Sample(contacts, self._slots, change, noise)
        self._samples = (*self._samples[-4 * self._count :], sample)

    def at(self, time: float | None = None) -> PolicyView | None:
        """Touch at a moment of the host's clock, s, of the last few; None: of the newest frame.

        None is returned until there is a frame with a reference.
        """
        samples = self._samples
        if not samples:
            return None
        times = np.array([sample.contacts.when for sample in samples])
        time = float(times[-1]) if time is None else time
        chosen = last_before(times, np.array([time]), self._count)[0]
        newest, ages = samples[chosen[-1]], time - times[chosen]
        holds = bool(still_holds(times, ages[-1:])[0])
        valid = newest.contacts.valid and holds
        table = newest.slots.table * valid
        drawn, shows_all = self._drawn(newest.contacts if valid else None)
        return PolicyView(
            valid=valid,
            time=time,
            slots=table,
            points=_points(table),
            point_mask=table[:, _KNOWN] > 0,
            map=drawn,
            map_mask=self._grid.mask,
            map_valid=shows_all,
            pose=np.array(pose_row(newest.contacts)) * holds,
            vector=newest.change / _floored(newest.noise),
            window=np.array([samples[index].change for index in chosen]),
            ages=ages,
        )

    def _drawn(self, contacts: Contacts | None) -> tuple[FloatArray, bool]:
        """The map, and whether it shows all that touches; blank of what is not valid."""
        if contacts is None:
            return np.zeros(self._grid.mask.shape), False
        if self._newtons:
            known = all(touch.detection.force is not None for touch in contacts.tracked)
            return self._grid.pressure(contacts), known
        return self._grid.conductance(contacts), contacts.image is not None


def _points(table: FloatArray) -> FloatArray:
    push = -table[:, FIELDS.index("force")][:, None] * table[:, _NORMAL]
    return np.hstack((table[:, _POSITION], table[:, _MOTION], push))


def _floored(noise: FloatArray) -> FloatArray:
    """Without zeros, which measurements without any noise would have."""
    positive = noise[noise > 0]
    return np.maximum(noise, 0.1 * np.median(positive) if len(positive) else 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    """A square raster over the sheet: centres (size,) of its columns and rows, m."""

    pixels: PixelMap
    x: FloatArray
    y: FloatArray
    corner: tuple[int, int]
    mask: _MASK

    @classmethod
    def of(cls, prepared: Prepared, size: int) -> Self:
        pixels = prepared.mesh.pixels(size)
        (height, width), step = pixels.cells.shape, abs(pixels.x[1] - pixels.x[0])
        top, column = (size - height) // 2, (size - width) // 2
        mask = np.zeros((size, size), dtype=bool)
        mask[top : top + height, column : column + width] = pixels.cells >= 0
        x = pixels.x[0] + step * (np.arange(size) - column)
        y = pixels.y[0] - step * (np.arange(size) - top)
        return cls(pixels, x, y, (top, column), mask)

    def conductance(self, contacts: Contacts) -> FloatArray:
        """The image, which is 0 outside of the sheet."""
        drawn = np.zeros(self.mask.shape)
        if contacts.image is not None:
            values = contacts.image.on_pixels(self.pixels)
            (top, column), (height, width) = self.corner, values.shape
            drawn[top : top + height, column : column + width] = np.nan_to_num(values)
        return drawn

    def pressure(self, contacts: Contacts) -> FloatArray:
        """N/cm²: each force that is known, even over the area of its touch."""
        drawn = np.zeros(self.mask.shape)
        cell = _CM2 * abs((self.x[1] - self.x[0]) * (self.y[1] - self.y[0]))
        for touch in contacts.tracked:
            spot = touch.detection
            if spot.force is None:
                continue
            apart = (self.x - spot.x) ** 2 + (self.y[:, None] - spot.y) ** 2
            apart = np.where(self.mask, apart, np.inf)
            under = apart <= max(spot.area / np.pi, float(apart.min()))
            drawn[under] += spot.force.value / (cell * np.count_nonzero(under))
        return drawn
