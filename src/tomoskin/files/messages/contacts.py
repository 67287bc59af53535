"""One frame as it leaves the program: its touches, and whether to rely on them.

Every message, table and file for other programs is made from :class:`Contacts`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from tomoskin.core import MEASURANDS, Detection, Event, FloatArray, Image, Touch
from tomoskin.files.messages.deformation import deformation_content
from tomoskin.files.messages.place import LinkPose
from tomoskin.files.messages.stream import Stream
from tomoskin.learning import FORCE
from tomoskin.model.mesh import Surface, quaternion
from tomoskin.pipeline import FrameResult
from tomoskin.sensing.fit import Deformation
from tomoskin.sensing.track import TouchEvent

NO_REFERENCE = "the reference has not been taken yet: do not touch the skin for a moment"

_ANYWHERE = 1.0
"""Variance of a position on a sheet whose noise is not known, m²: beyond any skin."""

_DENT = 1e-4
"""Variance of a position along the normal, m²: a press dents a skin by a centimetre at most."""

_ANY_TURN = math.pi**2 / 3
"""Variance of an angle of which nothing is known, rad²."""

_TURN = np.arange(12)[:, None] * math.pi / 6 + (0, -math.pi / 2)
_SPREAD = np.sqrt(-2 * np.log([[0.75], [0.25]] * 6)) * np.cos(_TURN)
"""Points of an ellipse, in standard deviations along its axes: each stands for a twelfth."""

_UNCALIBRATED = {
    f"{name}{part}": value
    for name in MEASURANDS
    for part, value in (("", None), ("_interval", None), ("_calibrated", False))
}
"""What a row says of a touch whose force and depth nothing tells."""

Vector = tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """One touch in space.

    Attributes
    ----------
    touch
        Its identity, and where it is on the sheet.
    position
        (3,) m, on the surface, in the frame of its :class:`Contacts`.
    axes
        Unit vectors: along the sheet's x, across it, and away from the body.
    slope
        (3, 2): derivative of the position by the sheet's x and y.
    link
        Where that frame is on the robot; None where there is none.
    """

    touch: Touch
    position: Vector
    axes: tuple[Vector, Vector, Vector] = field(repr=False)
    slope: FloatArray = field(repr=False)
    link: LinkPose | None = field(default=None, repr=False)

    @classmethod
    def each(
        cls, touches: Sequence[Touch], surface: Surface, link: LinkPose | None = None
    ) -> tuple[Self, ...]:
        """Of touches of the sheet that lies on ``surface``; plain numbers, which is faster."""
        if not touches:
            return ()
        uv = np.array([(touch.detection.x, touch.detection.y) for touch in touches])
        places, slopes = surface.point(uv).tolist(), surface.jacobian(uv)
        return tuple(
            cls(touch, tuple(place), _axes(*slope.T.tolist()), slope, link)
            for touch, place, slope in zip(touches, places, slopes, strict=True)
        )

    @property
    def normal(self) -> Vector:
        """(3,) unit vector, away from the body."""
        return self.axes[2]

    @property
    def root_position(self) -> Vector | None:
        """(3,) m in the root frame of the robot; None where the pose of the link is not known."""
        pose = self.link and self.link.pose
        return tuple(pose(np.array(self.position)).tolist()) if pose else None

    @property
    def root_normal(self) -> Vector | None:
        """(3,) unit vector in that frame; None where the pose of the link is not known."""
        pose = self.link and self.link.pose
        return tuple((pose.rotation @ self.normal).tolist()) if pose else None

    @property
    def is_self(self) -> bool | None:
        """Whether a link of the robot itself touches, see :meth:`LinkPose.mark`."""
        return None if self.link is None else self.link.mark(self.touch, lambda: self.ellipse)

    @property
    def ellipse(self) -> FloatArray:
        """(n, 3) m: points that stand for where it may be, along the surface."""
        spread = self.covariance
        values, vectors = np.linalg.eigh(np.zeros((3, 3)) if spread is None else spread)
        axes = vectors * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(self.position + _SPREAD @ axes[:, 1:].T)  # the first is along the normal

    @property
    def orientation(self) -> Vector:
        """X, y, z, w of the rotation to the axes."""
        return quaternion(self.axes)

    @property
    def covariance(self) -> FloatArray | None:
        """(3, 3) m² of the position, along the surface only; None where it is not known."""
        d = self.touch.detection
        known = math.isfinite(d.sd_x) and math.isfinite(d.sd_y)
        return self._in_space(_on_sheet(d)) if known else None

    @property
    def pose_covariance(self) -> FloatArray:
        """(6, 6) of position and rotation, m² and rad².

        What is not measured has the variance of what it can be: along the normal that of a dent,
        and of a rotation that of any angle. So programs that draw it show the size of a skin.
        """
        whole = _ANY_TURN * np.eye(6)
        normal = np.array(self.normal)
        whole[:3, :3] = self._in_space(_on_sheet(self.touch.detection))
        whole[:3, :3] += _DENT * normal[:, None] * normal
        return whole

    @property
    def force(self) -> float:
        """N, against the normal; NaN where nothing tells it."""
        force = self.touch.detection.force
        return math.nan if force is None else force.value

    @property
    def push(self) -> FloatArray:
        """(3,) N, into the body; NaN where nothing tells it."""
        return -self.force * np.array(self.normal)

    @property
    def torque(self) -> FloatArray:
        """(3,) N m of the push about the origin of the frame of coordinates."""
        return np.cross(self.position, self.push)

    def content(self) -> dict[str, Any]:
        """As plain values by name: on the sheet, in space, and on a robot in its root frame."""
        spread = self.covariance
        content = {
            **_UNCALIBRATED,
            **touch_row(self.touch),
            "provisional": self.touch.provisional,
            "position": self.position,
            "normal": self.normal,
            "covariance": None if spread is None else spread.tolist(),
        }
        if self.link is not None:
            content |= {"root_position": self.root_position, "root_normal": self.root_normal}
            content |= {"self": self.is_self, "self_problem": self.link.self_problem}
        return content

    def _in_space(self, sheet: FloatArray) -> FloatArray:
        """(3, 3) of a covariance (2, 2) on the sheet."""
        return np.asarray(self.slope @ sheet @ self.slope.T)


@dataclass(frozen=True, eq=False)
class Contacts:
    """All touches of one frame: whose, when, in which coordinates, and whether to rely on them.

    Attributes
    ----------
    stream
        Which skin it is.
    sequence, host_time
        As in the frame that was measured: its number, and monotonic s when its last byte came.
    valid
        Whether "no touch" means that nothing touches: a reference stands, enough electrodes
        work, and frames come.
    problem
        What is wrong, in a sentence, or None.
    latency
        s from the middle of the scan until this record was made; None for what was recorded.
    tracked
        The touches on the sheet, in the order of their identities.
    happened
        What happened to touches in this frame: onset, move, release, merge, split.
    voltages, reference
        (n_meas,) V; None where no frame came, or no reference stands.
    change, noise
        (n_meas,) V against the reference, 0 of measurements that are excluded, as in the image;
        and the standard deviation of one frame. None without a reference.
    image
        Change of conductivity; None where a newer frame waits, or one was sent a moment ago.
    scanned, scan_time
        Middle of the scan on the same clock as ``host_time``, and how long it took, s; NaN where
        no frame came, or its board has no clock.
    measured
        Middle of the scan on this machine's monotonic clock, also of a replay that a run plays;
        NaN where the frame is not of now, and minus infinity where none has come.
    is_due
        Whether the touches are worth a message.
    reports
        Whether it is time to say how the skin is.
    weighs
        Whether forces are calibrated.
    deformation
        How the sheet is deformed as a whole; None where it is not. Touches stay what they are.
    """

    stream: Stream = field(repr=False)
    sequence: int
    host_time: float
    valid: bool
    problem: str | None
    latency: float | None
    tracked: tuple[Touch, ...] = ()
    happened: tuple[TouchEvent, ...] = ()
    voltages: FloatArray | None = field(default=None, repr=False)
    reference: FloatArray | None = field(default=None, repr=False)
    image: Image | None = field(default=None, repr=False)
    scanned: float = math.nan
    scan_time: float = math.nan
    measured: float = math.nan
    is_due: bool = True
    reports: bool = True
    weighs: bool = False
    deformation: Deformation | None = None
    change: FloatArray | None = field(default=None, repr=False)
    noise: FloatArray | None = field(default=None, repr=False)

    @classmethod
    def of(cls, stream: Stream, result: FrameResult, measured: float | None = None) -> Self:
        """What ``result`` says of the skin; of a replay that is played: as if ``measured`` then."""
        valid = result.ready and result.has_image
        when = _when(result.scanned, result.host_time)
        contacts = cls(
            stream=stream,
            sequence=result.sequence,
            host_time=result.host_time,
            valid=valid,
            problem=result.problem if result.ready else NO_REFERENCE,
            latency=stream.latency(when),
            tracked=result.touches,
            happened=result.events,
            voltages=result.voltages,
            reference=result.reference if result.ready else None,
            image=result.image if valid else None,
            scanned=result.scanned,
            scan_time=result.scan_time,
            weighs=FORCE.name in result.calibrated,
            deformation=result.deformation,
            change=_change(result) if result.ready else None,
            noise=result.baseline.deviation if result.ready and result.baseline else None,
            measured=(math.nan if stream.replayed else when) if measured is None else measured,
        )
        return contacts.kept()

    def kept(self) -> Self:
        """The same without touches by the robot's own links, where the robot leaves these out."""
        if self.stream.place is None or not self.stream.place.leaves_out:
            return self
        return replace(
            self,
            tracked=tuple(c.touch for c in self.touches if not c.is_self),
            happened=tuple(event for event, c in _happened(self) if not c.is_self),
        )

    def outdated(self, problem: str) -> Self:
        """The same, but no touches, which are not true any more, and why."""
        return replace(
            self, valid=False, problem=problem, tracked=(), happened=(), deformation=None,
            voltages=None, reference=None, change=None, image=None,
        )  # fmt: skip

    @property
    def age_s(self) -> float:
        """S since the middle of the scan, at this moment; NaN of a file, infinite of no frame."""
        return time.monotonic() - self.measured

    @property
    def force(self) -> float:
        """N, of all touches against their normals; NaN where one is not known, nothing tells of
        forces, or none is valid."""
        return sum((c.force for c in self.touches), start=self.nothing)

    @property
    def nothing(self) -> float:
        """N that a sum of forces begins with: 0, or NaN where even no touch has no known force."""
        return 0.0 if self.valid and (self.weighs or self.tracked) else math.nan

    @property
    def skin(self) -> str:
        """Name of the skin that is touched."""
        return self.stream.skin

    @property
    def frame_id(self) -> str:
        """Name of the frame of coordinates."""
        return self.stream.naming.frame_id

    @property
    def when(self) -> float:
        """The time that the touches are of: the middle of the scan where it is known, s."""
        return _when(self.scanned, self.host_time)

    @property
    def utc(self) -> float | None:
        """S since 1970 of the middle of the scan; None in a simulation."""
        return self.stream.utc(self.when)

    @cached_property
    def touches(self) -> tuple[Contact, ...]:
        """The touches in space, in the order of their identities."""
        return Contact.each(self.tracked, self.stream.surface, self.link)

    @property
    def link(self) -> LinkPose | None:
        """Where the link of the robot was at that time; None where the skin lies on none."""
        return self.stream.link(self.utc)

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened to touches, in words."""
        return tuple(map(event_of, self.happened))

    def header(self) -> dict[str, Any]:
        """Everything but the touches, as plain values by name."""
        return {
            "host_time": self.host_time,
            "utc_s": self.utc,
            "scan_s": None if math.isnan(self.scan_time) else round(self.scan_time, 6),
            "skin": self.skin,
            "frame_id": self.frame_id,
            "sequence": self.sequence,
            "latency_s": self.latency,
            "valid": self.valid,
            "problem": self.problem,
            "deformation": deformation_content(self.deformation),
            **(self.link.content() if self.link else {}),
        }

    def content(self) -> dict[str, Any]:
        """Everything as plain values by name, the touches too."""
        return self.header() | {"touches": [touch.content() for touch in self.touches]}


def happenings(contacts: Contacts) -> list[dict[str, Any]]:
    """Each thing that happened to a touch, with that touch, as plain values by name."""
    return [
        {"time_s": event.host_time, "event": event.kind} | contacts.header() | contact.content()
        for event, contact in _happened(contacts)
    ]


def own_touches(stream: Stream, result: FrameResult) -> set[int]:
    """Identities of the touches of a frame that links of the robot itself make."""
    link = stream.link(stream.utc(_when(result.scanned, result.host_time)))
    touches = Contact.each(result.touches, stream.surface, link) if link else ()
    return {contact.touch.id for contact in touches if contact.is_self}


def _happened(contacts: Contacts) -> Iterator[tuple[TouchEvent, Contact]]:
    """What happened to touches, each with that touch in space."""
    events = contacts.happened
    touches = [event.touch for event in events]
    return zip(events, Contact.each(touches, contacts.stream.surface, contacts.link), strict=True)


def without_frame(stream: Stream, problem: str, host_time: float) -> Contacts:
    """Of a skin of which no frame has come, and why."""
    return Contacts(stream, -1, host_time, False, problem, None, measured=-math.inf)


def _change(result: FrameResult) -> FloatArray:
    change = result.voltages - result.reference
    excluded = ~np.isfinite(change)
    if result.health is not None:
        excluded |= result.health.lost
    return np.where(excluded, 0, change)


def time_of(item: Contacts | Event) -> float:
    """The time that a message is stamped with, on the host's clock, s."""
    return item.host_time if isinstance(item, Event) else item.when


def _when(scanned: float, host_time: float) -> float:
    return host_time if math.isnan(scanned) else scanned


def touch_row(touch: Touch) -> dict[str, Any]:
    """One touch as plain values by name; force, N, and depth, m, only where calibrations tell them,
    other places only where the pattern cannot tell them apart."""
    r = touch.detection
    amounts: dict[str, Any] = {}
    for name, amount in touch.amounts.items():
        interval = amount.low, amount.high
        amounts |= {name: amount.value, f"{name}_interval": interval, f"{name}_calibrated": True}
    if touch.elsewhere:
        amounts["elsewhere"] = touch.elsewhere
    return amounts | {
        "id": touch.id, "kind": touch.kind, "since": touch.since,
        "x": r.x, "y": r.y, "sd_x": r.sd_x, "sd_y": r.sd_y, "area": r.area, "peak": r.peak,
        "cov_xy": r.cov_xy, "close": r.close, "merged": touch.merged,
        "possible": touch.possible,
    }  # fmt: skip


def event_of(happened: TouchEvent) -> Event:
    """What happened to a touch as an event: "touch-onset", "touch-move", "touch-release", …"""
    return Event(happened.host_time, f"touch-{happened.kind}", happened.text)


def event_content(stream: Stream, event: Event, frame: Contacts | None = None) -> dict[str, Any]:
    """An event as plain values; what happened in a ``frame`` has its time in UTC, and of a replay
    other events have none."""
    own = None if stream.replayed else stream.utc(event.host_time)
    return {
        "time_s": event.host_time,
        "kind": event.kind,
        "text": event.text,
        "utc_s": own if frame is None else frame.utc,
        "skin": stream.skin,
        "frame_id": stream.naming.frame_id,
    }


def _on_sheet(detection: Detection) -> FloatArray:
    """(2, 2) m², the covariance of a position on the sheet."""
    x, y, xy = detection.sd_x * detection.sd_x, detection.sd_y * detection.sd_y, detection.cov_xy
    if not (math.isfinite(x) and math.isfinite(y)):
        x, y, xy = x if math.isfinite(x) else _ANYWHERE, y if math.isfinite(y) else _ANYWHERE, 0.0
    return np.array([[x, xy], [xy, y]])


def _axes(along: Vector, up: Vector) -> tuple[Vector, Vector, Vector]:
    """Unit vectors along the sheet's x, across it, and away from the body."""
    along = _unit(along)
    normal = _unit(_cross(along, _unit(up)))
    return along, _cross(normal, along), normal


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(vector: Sequence[float]) -> Vector:
    length = math.hypot(*vector)
    return tuple(value / length for value in vector)
