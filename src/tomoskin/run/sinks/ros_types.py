"""Types of ROS 2 messages: their fields, names, definitions and hashes."""

from __future__ import annotations

import functools
import hashlib
import json
from dataclasses import dataclass
from typing import Any

TYPES: dict[str, dict[str, str]] = {
    "builtin_interfaces/msg/Time": {"sec": "int32", "nanosec": "uint32"},
    "builtin_interfaces/msg/Duration": {"sec": "int32", "nanosec": "uint32"},
    "std_msgs/msg/Header": {"stamp": "builtin_interfaces/msg/Time", "frame_id": "string"},
    "std_msgs/msg/String": {"data": "string"},
    "std_msgs/msg/ColorRGBA": {"r": "float32", "g": "float32", "b": "float32", "a": "float32"},
    "geometry_msgs/msg/Point": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/msg/Vector3": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/msg/Quaternion": {
        "x": "float64", "y": "float64", "z": "float64", "w": "float64",
    },
    "geometry_msgs/msg/Pose": {
        "position": "geometry_msgs/msg/Point", "orientation": "geometry_msgs/msg/Quaternion",
    },
    "geometry_msgs/msg/PoseWithCovariance": {
        "pose": "geometry_msgs/msg/Pose", "covariance": "float64[36]",
    },
    "geometry_msgs/msg/PoseWithCovarianceStamped": {
        "header": "std_msgs/msg/Header", "pose": "geometry_msgs/msg/PoseWithCovariance",
    },
    "geometry_msgs/msg/Twist": {
        "linear": "geometry_msgs/msg/Vector3", "angular": "geometry_msgs/msg/Vector3",
    },
    "geometry_msgs/msg/TwistWithCovariance": {
        "twist": "geometry_msgs/msg/Twist", "covariance": "float64[36]",
    },
    "geometry_msgs/msg/Wrench": {
        "force": "geometry_msgs/msg/Vector3", "torque": "geometry_msgs/msg/Vector3",
    },
    "geometry_msgs/msg/WrenchStamped": {
        "header": "std_msgs/msg/Header", "wrench": "geometry_msgs/msg/Wrench",
    },
    "geometry_msgs/msg/Transform": {
        "translation": "geometry_msgs/msg/Vector3", "rotation": "geometry_msgs/msg/Quaternion",
    },
    "geometry_msgs/msg/TransformStamped": {
        "header": "std_msgs/msg/Header", "child_frame_id": "string",
        "transform": "geometry_msgs/msg/Transform",
    },
    "tf2_msgs/msg/TFMessage": {"transforms": "geometry_msgs/msg/TransformStamped[]"},
    "nav_msgs/msg/Odometry": {
        "header": "std_msgs/msg/Header", "child_frame_id": "string",
        "pose": "geometry_msgs/msg/PoseWithCovariance",
        "twist": "geometry_msgs/msg/TwistWithCovariance",
    },
    "sensor_msgs/msg/Image": {
        "header": "std_msgs/msg/Header", "height": "uint32", "width": "uint32",
        "encoding": "string", "is_bigendian": "uint8", "step": "uint32", "data": "uint8[]",
    },
    "sensor_msgs/msg/CompressedImage": {
        "header": "std_msgs/msg/Header", "format": "string", "data": "uint8[]",
    },
    "sensor_msgs/msg/PointField": {
        "name": "string", "offset": "uint32", "datatype": "uint8", "count": "uint32",
    },
    "sensor_msgs/msg/PointCloud2": {
        "header": "std_msgs/msg/Header", "height": "uint32", "width": "uint32",
        "fields": "sensor_msgs/msg/PointField[]", "is_bigendian": "bool", "point_step": "uint32",
        "row_step": "uint32", "data": "uint8[]", "is_dense": "bool",
    },
    "tactile_msgs/msg/TactileContact": {
        "header": "std_msgs/msg/Header", "name": "string", "position": "geometry_msgs/msg/Point",
        "normal": "geometry_msgs/msg/Vector3", "wrench": "geometry_msgs/msg/Wrench",
    },
    "tactile_msgs/msg/TactileContacts": {"contacts": "tactile_msgs/msg/TactileContact[]"},
    "visualization_msgs/msg/UVCoordinate": {"u": "float32", "v": "float32"},
    "visualization_msgs/msg/MeshFile": {"filename": "string", "data": "uint8[]"},
    "visualization_msgs/msg/Marker": {
        "header": "std_msgs/msg/Header", "ns": "string", "id": "int32", "type": "int32",
        "action": "int32", "pose": "geometry_msgs/msg/Pose", "scale": "geometry_msgs/msg/Vector3",
        "color": "std_msgs/msg/ColorRGBA", "lifetime": "builtin_interfaces/msg/Duration",
        "frame_locked": "bool", "points": "geometry_msgs/msg/Point[]",
        "colors": "std_msgs/msg/ColorRGBA[]", "texture_resource": "string",
        "texture": "sensor_msgs/msg/CompressedImage",
        "uv_coordinates": "visualization_msgs/msg/UVCoordinate[]", "text": "string",
        "mesh_resource": "string", "mesh_file": "visualization_msgs/msg/MeshFile",
        "mesh_use_embedded_materials": "bool",
    },
    "visualization_msgs/msg/MarkerArray": {"markers": "visualization_msgs/msg/Marker[]"},
    "diagnostic_msgs/msg/KeyValue": {"key": "string", "value": "string"},
    "diagnostic_msgs/msg/DiagnosticStatus": {
        "level": "byte", "name": "string", "message": "string", "hardware_id": "string",
        "values": "diagnostic_msgs/msg/KeyValue[]",
    },
    "diagnostic_msgs/msg/DiagnosticArray": {
        "header": "std_msgs/msg/Header", "status": "diagnostic_msgs/msg/DiagnosticStatus[]",
    },
}  # fmt: skip
"""Fields of each message by name, in order: a number, ``string``, another message, or an array."""

_IDS = {
    "uint8": 3, "int32": 6, "uint32": 7, "float32": 10, "float64": 11,
    "bool": 15, "byte": 16, "string": 17,
}  # fmt: skip
_NESTED, _FIXED, _ENDLESS = 1, 48, 144


@dataclass(frozen=True)
class Field:
    """``kind`` without its brackets; ``length`` of an array: 0 for any, None where it is none."""

    kind: str
    length: int | None

    @staticmethod
    @functools.cache
    def of(text: str) -> Field:
        """The field that a message's table writes as ``text``."""
        kind, bracket, length = text.rstrip("]").partition("[")
        return Field(kind, int(length or 0) if bracket else None)

    def description(self) -> dict[str, Any]:
        """What a type's hash is made of."""
        number = _IDS.get(self.kind, _NESTED)
        if self.length is not None:
            number += _FIXED if self.length else _ENDLESS
        return {
            "type_id": number,
            "capacity": self.length or 0,
            "string_capacity": 0,
            "nested_type_name": "" if self.kind in _IDS else self.kind,
        }


def type_hash(kind: str) -> str:
    """RIHS01 hash of a message's type, as ROS 2 has it from Iron on."""
    content = {
        "type_description": _described(kind),
        "referenced_type_descriptions": [_described(name) for name in sorted(_used_by(kind))],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(content).encode()).hexdigest()


def dds_name(kind: str) -> str:
    """Name of a message's type on the wire: ``std_msgs::msg::dds_::String_``."""
    package, _, name = kind.rpartition("/")
    return f"{package.replace('/', '::')}::dds_::{name}_"


def definition(kind: str) -> list[str]:
    """The text of a message's definition, then that of each message in it, headed by its name."""
    inner = (f"MSG: {_short(name)}\n{_fields(name)}" for name in sorted(_used_by(kind)))
    return [_fields(kind), *inner]


def _fields(kind: str) -> str:
    return "\n".join(f"{_short(text)} {name}" for name, text in TYPES[kind].items())


def _short(kind: str) -> str:
    """As definitions name it: without "msg"."""
    return kind.replace("/msg/", "/")


def _described(kind: str) -> dict[str, Any]:
    fields = [
        {"name": name, "type": Field.of(text).description()} for name, text in TYPES[kind].items()
    ]
    return {"type_name": kind, "fields": fields}


def _used_by(kind: str) -> set[str]:
    direct = {Field.of(text).kind for text in TYPES[kind].values()} & TYPES.keys()
    return direct.union(*(_used_by(name) for name in direct))
