"""The ROS 2 sink, heard by a node of ROS 2 itself, on Fast DDS and over loopback."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from extras.ros2.test_ros2 import LOOPBACK
from files.session.runs import TOUCH
from run.sinks.conftest import EPOCH, EVENT, MESH, begin
from tomoskin.extras.ros2.ros_types import dds_name
from tomoskin.extras.ros2.ros_view import TOPICS
from tomoskin.run.sinks import make_sink

NODE = Path(__file__).with_name("ros_node.py")
WHEELS = (
    "ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-sensor-msgs ros-jazzy-visualization-msgs "
    "ros-jazzy-diagnostic-msgs"
)
HEARD = "touch", "wrench", "valid", "touches", "markers", "points", "image", "voltages", "rows"
"""Topics whose types are among the wheels; odometry, tf and tactile_msgs are not."""

FAST_DDS = """<?xml version="1.0"?>
<dds xmlns="http://www.eprosima.com"><profiles>
 <transport_descriptors><transport_descriptor>
  <transport_id>loopback</transport_id><type>UDPv4</type>
  <interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>
 </transport_descriptor></transport_descriptors>
 <participant profile_name="loopback" is_default_profile="true"><rtps>
  <userTransports><transport_id>loopback</transport_id></userTransports>
  <useBuiltinTransports>false</useBuiltinTransports>
  <builtin><initialPeersList><locator><udpv4>
   <address>127.0.0.1</address>
  </udpv4></locator></initialPeersList></builtin>
 </rtps></participant>
</profiles></dds>
"""


@pytest.fixture
def sink(stream, tmp_path, monkeypatch):
    """Open, on a domain of its own, where both kinds of DDS speak on loopback only."""
    pytest.importorskip("rclpy", reason=f"ROS 2 is not installed: pip install {WHEELS}")
    profiles = tmp_path / "fast_dds.xml"
    profiles.write_text(FAST_DDS)
    for name, value in {
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(profiles),
        "CYCLONEDDS_URI": LOOPBACK,
        "ROS_DOMAIN_ID": str(100 + os.getpid() % 100),
        "ROS_LOG_DIR": str(tmp_path),
    }.items():
        monkeypatch.setenv(name, value)
    points = np.column_stack([MESH.centroids, np.zeros(len(MESH.cells))])
    opened = make_sink("ros2:namespace=left_arm")
    opened.contacts_at = begin(opened, replace(stream, points=points))
    yield opened
    opened.close()


@pytest.mark.slow
def test_a_node_of_ros_2_hears_every_topic_that_it_has_a_type_for(program, sink):
    topics = {f"/left_arm/{name}" for name in HEARD} | {"/diagnostics"}
    announced, heard = {}, {}

    def publish(number):
        sink.publish(sink.contacts_at(10.0 * number + 0.25, TOUCH, sequence=number))
        sink.publish(EVENT)

    for text in program(str(NODE), *topics).lines(publish):
        if text.startswith("{"):
            line = json.loads(text)
            (announced if "topic" in line else heard).setdefault(
                line.get("topic") or line["heard"], line
            )
        if heard.keys() == topics:
            break
    for topic, line in announced.items():
        kind = TOPICS[topic.removeprefix("/left_arm/")]
        package, folder, name = line["type"].split("/")
        assert (line["node"], dds_name(kind)) == ("left_arm", f"{package}::{folder}::dds_::{name}_")
    said = {topic: line["value"] for topic, line in heard.items()}
    pose = said["/left_arm/touch"]
    assert pose["header"]["frame_id"] == "left_arm/skin"
    assert pose["header"]["stamp"]["sec"] >= EPOCH
    place = pose["pose"]["pose"]["position"]
    assert (place["x"], place["y"]) == (TOUCH.detection.x, TOUCH.detection.y)
    assert said["/left_arm/valid"] == {"data": True}
    assert json.loads(said["/left_arm/touches"]["data"])["touches"][0]["id"] == 4
    assert np.isnan(list(said["/left_arm/wrench"]["wrench"]["force"].values())).all()
    assert said["/left_arm/points"]["width"] == len(MESH.cells)
    assert said["/diagnostics"]["status"][0]["message"] == "OK"
