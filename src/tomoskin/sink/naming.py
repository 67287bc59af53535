"""What other programs know a skin by, and where its touches are for them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from tomoskin.core import Detection, Event, FloatArray, SinkError, Touch
from tomoskin.mesh import Surface
from tomoskin.recording import touch_row
from tomoskin.sink.sink import Moment, Stream

UNKNOWN = 1e6
"""Variance of what is not measured, m² or rad²: what filters take for no knowledge."""

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
        (3,) m, on the surface.
    axes
        (3, 3) unit vectors as columns: along the sheet's x, across it, and away from the body.
    covariance
        (6, 6) of position and rotation, m² and rad²; along the normal, and of rotations, it is
        :data:`UNKNOWN`.
    """

    position: FloatArray = field(repr=False)
    axes: FloatArray = field(repr=False)
    covariance: FloatArray = field(repr=False)

    @classmethod
    def of(cls, detection: Detection, surface: Surface) -> Self:
        """Where a detection of the sheet is on its ``surface``."""
        uv = [[detection.x, detection.y]]
        (slope,), (normal,) = surface.jacobian(uv), surface.normal(uv)
        along = slope[:, 0] / np.linalg.norm(slope[:, 0])
        covariance = UNKNOWN * np.eye(6)
        covariance[:3, :3] = slope @ _on_sheet(detection) @ slope.T
        covariance[:3, :3] += UNKNOWN * np.outer(normal, normal)
        axes = np.column_stack((along, np.cross(normal, along), normal))
        return cls(surface.point(uv)[0], axes, covariance)


def touches_content(stream: Stream, naming: Naming, moment: Moment) -> dict[str, Any]:
    """All touches of a frame as plain values, with what makes them understood elsewhere."""
    return {
        "host_time": moment.host_time,
        **origin(stream, naming, moment.host_time),
        "sequence": moment.sequence,
        "touches": [touch_content(stream, touch) for touch in moment.touches],
    }


def event_content(stream: Stream, naming: Naming, event: Event) -> dict[str, Any]:
    """An event as plain values."""
    told = {"time_s": event.host_time, "kind": event.kind, "text": event.text}
    return told | origin(stream, naming, event.host_time)


def touch_content(stream: Stream, touch: Touch) -> dict[str, Any]:
    """One touch: on the sheet, and in space."""
    pose = SpacePose.of(touch.detection, stream.surface)
    return touch_row(touch) | {"position": pose.position, "normal": pose.axes[:, 2]}


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
