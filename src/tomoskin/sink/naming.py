"""What other programs know a skin by, and where its touches are for them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from tomoskin.core import Detection, Event, FloatArray, SinkError, Touch
from tomoskin.mesh import Surface
from tomoskin.recording import touch_row
from tomoskin.sink.sink import Moment, Stream

UNKNOWN = 1e6
"""Variance of what is not measured, m² or rad²: what filters take for no knowledge."""

Vector = tuple[float, ...]

_NAMESPACE = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)
_FRAME = re.compile(r"[\w.-]+(/[\w.-]+)*", re.ASCII)


@dataclass(frozen=True, slots=True)
class Naming:
    """Before what its topics begin with, and the frame of coordinates of its positions.

    ``frame`` is the sheet's plane, x right and y up seen from the front; of a skin on a surface
    it is that of the surface. Without a name of its own it is "skin", in another namespace
    "NAMESPACE/skin".
    """

    namespace: str = "tomoskin"
    frame: str = ""

    @classmethod
    def of(cls, options: Mapping[str, str], where: str) -> Self:
        """As ``namespace`` and ``frame`` say, as far as they are there; SinkError."""
        naming = cls(**{key: options[key] for key in ("namespace", "frame") if key in options})
        for key, text, form in (
            ("namespace", naming.namespace, _NAMESPACE),
            ("frame", naming.frame, _FRAME),
        ):
            if key in options and not form.fullmatch(text):
                raise SinkError(
                    f'expected a {key} of letters, digits and "_", with "/" between names, '
                    f'got "{text}"',
                    where=where,
                    hint=f"for example {key}=left_arm",
                )
        return naming

    @property
    def frame_id(self) -> str:
        """Name of the frame of coordinates."""
        default = "skin" if self.namespace == Naming().namespace else f"{self.namespace}/skin"
        return self.frame or default


@dataclass(frozen=True, slots=True, eq=False)
class SpacePose:
    """A touch in space.

    Attributes
    ----------
    position
        m, on the surface.
    axes
        Unit vectors: along the sheet's x, across it, and away from the body.
    slope
        (3, 2): derivative of the position by the sheet's x and y.
    """

    position: Vector
    axes: tuple[Vector, Vector, Vector]
    slope: FloatArray = field(repr=False)

    @classmethod
    def of(cls, detection: Detection, surface: Surface) -> Self:
        """Where a detection of the sheet is on its ``surface``; plain numbers, which is faster."""
        uv = [[detection.x, detection.y]]
        slope = surface.jacobian(uv)[0]
        along, up = map(_unit, slope.T.tolist())
        normal = _unit(_cross(along, up))
        x, y, z = surface.point(uv)[0].tolist()
        return cls((x, y, z), (along, _cross(normal, along), normal), slope)

    def covariance(self, detection: Detection) -> FloatArray:
        """(6, 6) of position and rotation, m² and rad².

        Along the normal, and of rotations, it is :data:`UNKNOWN`.
        """
        found = UNKNOWN * np.eye(6)
        normal = np.array(self.axes[2])
        found[:3, :3] = self.slope @ _on_sheet(detection) @ self.slope.T
        found[:3, :3] += UNKNOWN * normal[:, None] * normal
        return found

    def quaternion(self) -> tuple[float, ...]:
        """X, y, z, w of the rotation to the axes; of 4 q qᵀ the row that is best conditioned."""
        (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = self.axes
        rows = (
            (1 + xx - yy - zz, xy + yx, xz + zx, zy - yz),
            (xy + yx, 1 - xx + yy - zz, yz + zy, xz - zx),
            (xz + zx, yz + zy, 1 - xx - yy + zz, yx - xy),
            (zy - yz, xz - zx, yx - xy, 1 + xx + yy + zz),
        )
        return _unit(max(enumerate(rows), key=lambda item: item[1][item[0]])[1])


def poses_of(stream: Stream, touches: Sequence[Touch]) -> list[SpacePose]:
    """Where each touch is."""
    return [SpacePose.of(touch.detection, stream.surface) for touch in touches]


def touches_content(
    stream: Stream, naming: Naming, moment: Moment, poses: Sequence[SpacePose]
) -> dict[str, Any]:
    """All touches of a frame as plain values, with what makes them understood elsewhere."""
    rows = [touch_content(*both) for both in zip(moment.touches, poses, strict=True)]
    about = {"host_time": moment.host_time, **origin(stream, naming, moment.host_time)}
    return {**about, "sequence": moment.sequence, "touches": rows}


def event_content(
    stream: Stream, naming: Naming, event: Event, *, of_frame: bool = False
) -> dict[str, Any]:
    """An event as plain values; of a replay only those of its frames are known in UTC."""
    told = {"time_s": event.host_time, "kind": event.kind, "text": event.text}
    unknown = {"utc_s": None} if stream.replayed and not of_frame else {}
    return told | origin(stream, naming, event.host_time) | unknown


def touch_content(touch: Touch, pose: SpacePose) -> dict[str, Any]:
    """One touch: on the sheet, and in space."""
    return touch_row(touch) | {"position": pose.position, "normal": pose.axes[2]}


def origin(stream: Stream, naming: Naming, host_time: float) -> dict[str, Any]:
    """Whose it is, when in UTC (s since 1970; None in a simulation), in which coordinates."""
    utc = round(host_time + stream.epoch, 6) if stream.epoch else None
    return {"utc_s": utc, "skin": stream.skin, "frame_id": naming.frame_id}


def _on_sheet(detection: Detection) -> FloatArray:
    """(2, 2) m²."""
    variance = np.array([detection.sd_x**2, detection.sd_y**2])
    if np.isfinite(variance).all():
        return np.diag(variance) + detection.cov_xy * np.eye(2)[::-1]
    return np.diag(np.where(np.isfinite(variance), variance, UNKNOWN))


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(vector: Sequence[float]) -> Vector:
    length = math.hypot(*vector)
    return tuple(value / length for value in vector)
