"""What a robot needs of one frame: every message of touches is made from this one record."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Self

from tomoskin.core import Event, FloatArray, Touch
from tomoskin.files.session import touch_row
from tomoskin.run.sinks.naming import Naming
from tomoskin.run.sinks.sink import Moment, Stream
from tomoskin.run.sinks.space import SpacePose, Vector

_NO_FORCE = {"force": None, "force_interval": None, "force_calibrated": False}
"""What a row says of a touch whose force nothing tells."""


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """One touch in space.

    Attributes
    ----------
    touch
        Its identity, and where it is on the sheet.
    pose
        Where it is in the frame of its :class:`Contacts`.
    """

    touch: Touch
    pose: SpacePose = field(repr=False)

    @property
    def position(self) -> Vector:
        """(3,) m, on the surface."""
        return self.pose.position

    @property
    def normal(self) -> Vector:
        """(3,) unit vector, away from the body."""
        return self.pose.axes[2]

    @property
    def covariance(self) -> FloatArray | None:
        """(3, 3) m² of the position on the surface; None where it is not known."""
        return self.pose.position_covariance(self.touch.detection)

    @property
    def force(self) -> float | None:
        """N, against the normal; None where nothing tells it."""
        force = self.touch.detection.force
        return None if force is None else force.newtons

    def content(self) -> dict[str, Any]:
        """As plain values by name: on the sheet, and in space."""
        spread = self.covariance
        return (
            _NO_FORCE
            | touch_row(self.touch)
            | {
                "position": self.position,
                "normal": self.normal,
                "covariance": None if spread is None else spread.tolist(),
            }
        )


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """All touches of one frame: whose, when, in which coordinates, and whether to rely on them.

    Attributes
    ----------
    skin, frame_id
        Name of the skin, and of the frame of coordinates.
    sequence, host_time
        As in the frame that was measured: its number, and monotonic s when its last byte came.
    utc
        The same in s since 1970; None in a simulation.
    latency
        s from ``host_time`` until this record was made; None for what was recorded.
    valid
        Whether "no touch" means that nothing touches: a reference stands, and enough electrodes
        work.
    problem
        What is wrong, in a sentence, or None.
    touches
        In the order of their identities.
    """

    skin: str
    frame_id: str
    sequence: int
    host_time: float
    utc: float | None
    latency: float | None
    valid: bool
    problem: str | None
    touches: tuple[Contact, ...]

    @classmethod
    def of(cls, stream: Stream, naming: Naming, moment: Moment) -> Self:
        """What ``moment`` says."""
        return cls(
            skin=stream.skin,
            frame_id=naming.frame_id,
            sequence=moment.sequence,
            host_time=moment.host_time,
            utc=stream.utc(moment.host_time),
            latency=stream.latency(moment.host_time),
            valid=moment.valid,
            problem=moment.problem,
            touches=contacts_of(stream, moment),
        )

    def header(self) -> dict[str, Any]:
        """Everything but the touches, as plain values by name."""
        return {
            "host_time": self.host_time,
            "utc_s": self.utc,
            "skin": self.skin,
            "frame_id": self.frame_id,
            "sequence": self.sequence,
            "latency_s": self.latency,
            "valid": self.valid,
            "problem": self.problem,
        }

    def content(self) -> dict[str, Any]:
        """As plain values by name."""
        return self.header() | {"touches": [touch.content() for touch in self.touches]}


def contacts_of(stream: Stream, moment: Moment) -> tuple[Contact, ...]:
    """The touches of a frame, in space."""
    return tuple(contact_of(stream, touch) for touch in moment.touches)


def contact_of(stream: Stream, touch: Touch) -> Contact:
    """A touch of the skin, in space."""
    return Contact(touch, SpacePose.of(touch.detection, stream.surface))


def event_content(
    stream: Stream, naming: Naming, event: Event, *, of_frame: bool = False
) -> dict[str, Any]:
    """An event as plain values; of a replay only those of its frames are known in UTC."""
    unknown = stream.replayed and not of_frame
    return {
        "time_s": event.host_time,
        "kind": event.kind,
        "text": event.text,
        "utc_s": None if unknown else stream.utc(event.host_time),
        "skin": stream.skin,
        "frame_id": naming.frame_id,
    }
