"""Our Foxglove messages against the records of Foxglove's own SDK: names, kinds and numbers.

The program itself was never there to open them in.
"""

from __future__ import annotations

import base64
import json
import math

import pytest
from foxglove import messages as sdk

from files.session.runs import SKIN, TOUCH
from tomoskin.core import Event, Image, encode_json
from tomoskin.files.messages import Contact, grid_message, log_message, scene_message
from tomoskin.files.session import schema_of
from tomoskin.model.mesh import Cylinder, Plane

OURS = {"host_time", "unit"}
"""Fields that Foxglove does not know, and shows as they are."""

RECORDS = {
    "timestamp": sdk.Timestamp,
    "lifetime": sdk.Duration,
    "pose": sdk.Pose,
    "position": sdk.Vector3,
    "size": sdk.Vector3,
    "orientation": sdk.Quaternion,
    "cell_size": sdk.Vector2,
    "color": sdk.Color,
    "fields": sdk.PackedElementField,
    "deletions": sdk.SceneEntityDeletion,
    "entities": sdk.SceneEntity,
    "metadata": sdk.KeyValuePair,
    "spheres": sdk.SpherePrimitive,
    "texts": sdk.TextPrimitive,
}
ENUMS = {
    sdk.PackedElementField: sdk.PackedElementFieldNumericType,
    sdk.SceneEntityDeletion: sdk.SceneEntityDeletionType,
    sdk.Log: sdk.LogLevel,
}


def built(record, content):
    """``record`` made of JSON: the SDK refuses a name or a kind that it does not know."""
    fields = {
        name: valued(record, name, value) for name, value in content.items() if name not in OURS
    }
    return record(**fields)


def valued(record, name, value):
    if isinstance(value, dict):
        return built(RECORDS[name], value)
    if isinstance(value, list):
        return [built(RECORDS[name], item) for item in value]
    if name in ("type", "level"):
        return member(ENUMS[record], value)
    return base64.b64decode(value) if name == "data" else value


def member(kinds, value):
    """The member of one of the SDK's enumerations with that number."""
    every = [getattr(kinds, name) for name in dir(kinds) if name[0].isupper()]
    (found,) = [one for one in every if one.value == value]
    return found


@pytest.fixture
def image():
    mesh = SKIN.mesh()
    pixels = mesh.pixels(12)
    values = mesh.centroids[:, 0]
    return grid_message(Image(values, "S", mesh.identity), pixels, 1.5, 2_500_000_000)


@pytest.fixture
def scene():
    return scene_message(Contact.each([TOUCH], Plane()), 2_500_000_000)


def test_each_is_what_the_sdk_makes(image, scene):
    event = log_message(Event(1.5, "gap", "two frames"), 2_500_000_000)
    for record, content in ((sdk.Grid, image), (sdk.SceneUpdate, scene), (sdk.Log, event)):
        plain = json.loads(encode_json(content))
        assert built(record, plain) is not None
        with pytest.raises(TypeError):
            built(record, plain | {"colour": 1})


def test_the_numbers_of_kinds_are_the_sdks(image, scene):
    assert image["fields"][0]["type"] == sdk.PackedElementFieldNumericType.Float32.value
    assert scene["deletions"][0]["type"] == sdk.SceneEntityDeletionType.All.value
    event = log_message(Event(0.0, "connected", ""), 0)
    assert event["level"] == sdk.LogLevel.Info.value


@pytest.mark.parametrize("topic", ["/scene", "/image", "/events"])
def test_schemas_name_the_fields_of_the_messages(image, scene, topic):
    content = {"/scene": scene, "/image": image, "/events": log_message(Event(0, "a", "b"), 0)}
    schema = json.loads(schema_of(topic).data)
    assert names(content[topic]) == names_of_schema(schema)


def test_on_a_curved_skin_a_touch_is_in_space():
    (entity,) = scene_message(Contact.each([TOUCH], Cylinder(0.05)), 0)["entities"]
    for part in (entity["spheres"][0], entity["texts"][0]):
        x, y, z = part["pose"]["position"].values()
        assert math.hypot(x, z + 0.05) == pytest.approx(0.05)
        assert (y, z < -0.01) == (pytest.approx(TOUCH.detection.y), True)


def names(content):
    """Dotted names of all fields; lists by their first item."""
    found = set()
    for name, value in content.items():
        inner = value[0] if isinstance(value, list) and value else value
        found |= {name} | (
            {f"{name}.{n}" for n in names(inner)} if isinstance(inner, dict) else set()
        )
    return found


def names_of_schema(schema):
    found = set()
    for name, inner in schema.get("properties", {}).items():
        found |= {name} | {f"{name}.{n}" for n in names_of_schema(inner.get("items", inner))}
    return found
