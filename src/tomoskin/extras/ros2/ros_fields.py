"""What a frame says, as the fields of ROS 2 messages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tomoskin.core import FloatArray, Image, PixelMap
from tomoskin.files.messages import (
    TEXT_COLOUR,
    TEXT_HEIGHT,
    Contact,
    Contacts,
    Place,
    touch_colour,
    touch_width,
)

Value = dict[str, Any]

_SPHERE, _TEXT, _DELETE_ALL = 2, 9, 3
_OK, _WARN, _ERROR = 0, 1, 2
_FLOAT32 = 7
_NO_PARENT = "none: parent=LINK,at=X/Y/Z of the sink would publish where the frame is"
_NOT_MEASURED = {"covariance": (1e6 * np.eye(6)).ravel()}
"""Of velocities: what filters take for no knowledge."""


def header(stamp: int, frame: str) -> Value:
    """``std_msgs/Header`` of ``stamp`` ns since 1970."""
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}


def stamped_pose(head: Value, contact: Contact) -> Value:
    """``geometry_msgs/PoseWithCovarianceStamped``: on the surface, z along the normal."""
    pose = {"pose": _pose(contact), "covariance": contact.pose_covariance.ravel()}
    return {"header": head, "pose": pose}


def track(head: Value, contact: Contact) -> Value:
    """``nav_msgs/Odometry``: a pose with the touch's identity; velocities are not measured."""
    name = {"child_frame_id": _name(head, contact), "twist": _NOT_MEASURED}
    return stamped_pose(head, contact) | name


def contacts(head: Value, frame: Contacts) -> Value:
    """``tactile_msgs/TactileContacts``; a wrench is about the origin of the frame of coordinates,
    and NaN where force is not measured."""
    return {
        "contacts": [
            {
                "header": head,
                "name": _name(head, contact),
                "position": _named("xyz", contact.position),
                "normal": _named("xyz", contact.normal),
                "wrench": _wrench(contact.push, contact.torque),
            }
            for contact in frame.touches
        ]
    }


def wrench(head: Value, frame: Contacts) -> Value:
    """``geometry_msgs/WrenchStamped``: of all touches, about the frame's origin.

    It is NaN where touches are not valid, or the force of one is not measured.
    """
    nothing = np.full(3, frame.nothing)
    force = sum((contact.push for contact in frame.touches), start=nothing)
    torque = sum((contact.torque for contact in frame.touches), start=nothing)
    return {"header": head, "wrench": _wrench(force, torque)}


def markers(head: Value, frame: Contacts) -> Value:
    """``visualization_msgs/MarkerArray`` that shows these touches, and no others."""
    shown = [{"header": head, "action": _DELETE_ALL, "frame_locked": True}]
    for contact in frame.touches:
        width, place = touch_width(contact.touch), _pose(contact)
        about = {"header": head, "id": contact.touch.id, "pose": place, "frame_locked": True}
        sphere = {"ns": "touch", "type": _SPHERE, "color": touch_colour(contact.touch)}
        scale = _named("xyz", (width, width, 0.2 * width))
        shown.append(about | sphere | {"scale": scale})
        label = {"ns": "label", "type": _TEXT, "color": TEXT_COLOUR, "text": str(contact.touch.id)}
        shown.append(about | label | {"scale": {"z": TEXT_HEIGHT}})
    return {"markers": shown}


def diagnostics(head: Value, frame: Contacts) -> Value:
    """``diagnostic_msgs/DiagnosticArray``: an error where touches are not valid, and the board."""
    stream = frame.stream
    level = _ERROR if not frame.valid else _WARN if frame.problem else _OK
    values = {
        "sequence": frame.sequence,
        "latency_s": frame.latency,
        "touches": len(frame.touches),
        "valid": frame.valid,
        "deformation": frame.deformation.text if frame.deformation else "none",
        "frame": frame.frame_id,
        "parent": stream.parent or _NO_PARENT,
        **(stream.board() if stream.board else {}),
    }
    status = {
        "level": level,
        "name": f"{stream.naming.namespace}: skin",
        "message": frame.problem or "OK",
        "hardware_id": frame.skin,
        "values": [{"key": key, "value": str(value)} for key, value in values.items()],
    }
    return {"header": head, "status": [status]}


def touch_frames(head: Value, frame: Contacts) -> Value:
    """``tf2_msgs/TFMessage``: the frame of each touch, which tracks name, z along the normal."""
    moved = (_transform(head, _name(head, c), c.position, c.orientation) for c in frame.touches)
    return {"transforms": list(moved)}


def voltages(frame: Contacts) -> Value:
    """``std_msgs/Float32MultiArray``: a row of voltages, V, and one of the reference where it
    stands; the columns are those of :func:`rows`."""
    rows = [row for row in (frame.voltages, frame.reference) if row is not None]
    count = frame.stream.pattern.n_meas
    sizes = {"voltages, reference (V)": len(rows), "measurements": count}
    strides = len(rows) * count, count
    return {
        "layout": {
            "dim": [
                {"label": label, "size": size, "stride": stride}
                for (label, size), stride in zip(sizes.items(), strides, strict=True)
            ]
        },
        "data": np.concatenate(rows).astype("<f4"),
    }


def transform(stamp: int, frame: str, mount: Place) -> Value:
    """``tf2_msgs/TFMessage``: where the skin is on the robot."""
    position, rotation = mount.pose.position.tolist(), mount.pose.quaternion()
    return {"transforms": [_transform(header(stamp, mount.link), frame, position, rotation)]}


def image(head: Value, change: Image, pixels: PixelMap) -> Value:
    """``sensor_msgs/Image``: 32-bit floats, the top row first, NaN outside the sheet."""
    values = change.on_pixels(pixels).astype("<f4")
    height, width = values.shape
    return {
        "header": head,
        "height": height,
        "width": width,
        "encoding": "32FC1",
        "is_bigendian": 0,
        "step": 4 * width,
        "data": values.tobytes(),
    }


def points(head: Value, change: Image, places: FloatArray) -> Value:
    """``sensor_msgs/PointCloud2``: the change at the middle of each cell, in space."""
    data = np.column_stack([places, change.values]).astype("<f4")
    names = ("x", "y", "z", "change")
    return {
        "header": head,
        "height": 1,
        "width": len(data),
        "fields": [
            {"name": name, "offset": 4 * number, "datatype": _FLOAT32, "count": 1}
            for number, name in enumerate(names)
        ],
        "is_bigendian": False,
        "point_step": 4 * len(names),
        "row_step": data.nbytes,
        "data": data.tobytes(),
        "is_dense": True,
    }


def _transform(
    head: Value, child: str, position: Sequence[float], rotation: Sequence[float]
) -> Value:
    moved = {"translation": _named("xyz", position), "rotation": _named("xyzw", rotation)}
    return {"header": head, "child_frame_id": child, "transform": moved}


def _pose(contact: Contact) -> Value:
    return {
        "position": _named("xyz", contact.position),
        "orientation": _named("xyzw", contact.orientation),
    }


def _name(head: Value, contact: Contact) -> str:
    return f"{head['frame_id']}/touch_{contact.touch.id}"


def _wrench(force: FloatArray, torque: FloatArray) -> Value:
    return {"force": _named("xyz", force.tolist()), "torque": _named("xyz", torque.tolist())}


def _named(names: str, values: Sequence[float]) -> Value:
    return dict(zip(names, values, strict=True))
