"""The ROS 2 sink, heard by a participant of another process over loopback; nobody else is."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsSubscription
from cyclonedds.domain import DomainParticipant

from files.session.runs import TOUCH
from run.board import Board
from run.sinks.conftest import EPOCH, EVENT, MESH, PATIENCE, PATTERN, begin
from tomoskin.core import SinkError
from tomoskin.extras.ros2 import ros_fields
from tomoskin.extras.ros2.ros_types import dds_name, type_hash
from tomoskin.extras.ros2.ros_view import TOPICS
from tomoskin.files.session import SessionReader
from tomoskin.run import LiveSkin, Runner
from tomoskin.run.sinks import make_sink

PEER = Path(__file__).with_name("ros_peer.py")
CLIENT = Path(__file__).with_name("ros_client.py")
GRAPH = Path(__file__).with_name("ros_graph.py")
PARAMETERS = "list_parameters", "get_parameters", "describe_parameters", "set_parameters"
LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers>"
    "</Discovery></Domain></CycloneDDS>"
)


@pytest.fixture
def domain(monkeypatch):
    """A domain of this process' own, on loopback only."""
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(100 + os.getpid() % 100))
    return os.environ["ROS_DOMAIN_ID"]


@pytest.fixture
def sink(domain, stream):
    """Open, with all that a stream can have."""
    assert domain
    points = np.column_stack([MESH.centroids, np.zeros(len(MESH.cells))])
    opened = make_sink("ros2:namespace=left_arm,parent=tool0,at=0/0/0.05")
    opened.contacts_at = begin(opened, replace(stream, points=points))
    yield opened
    opened.close()


def heard_by(peer, sink, enough):
    """(topics announced, first message of each) once ``enough`` topics were heard."""
    topics, messages = {}, {}
    for text in peer.lines(lambda n: publish(sink, n)):
        line = json.loads(text)
        if "topic" in line:
            topics[line["topic"]] = line
        else:
            messages.setdefault(line["heard"], line)
        if len(messages) == enough:
            return topics, messages
    raise AssertionError("it goes on for ever")


def publish(sink, number):
    """Everything, so late by the clock that each frame is worth a report."""
    sink.publish(sink.contacts_at(10.0 * number + 0.25, TOUCH, sequence=number))
    sink.publish(EVENT)


def test_another_process_sees_what_ros_2_would(program, domain, sink):
    topics, messages = heard_by(program(str(PEER), domain), sink, len(TOPICS))
    named = {f"rt{name}" if name[0] == "/" else f"rt/left_arm/{name}": name for name in TOPICS}
    assert topics.keys() == messages.keys() == named.keys()
    for topic, said in topics.items():
        kind = TOPICS[named[topic]]
        assert said["type"] == dds_name(kind)
        assert said["data"] == f"typehash={type_hash(kind)};"
        assert said["kept"] == (named[topic] in {"/tf_static", "rows"})
    (contact,) = messages["rt/left_arm/contacts"]["value"]["contacts"]
    assert contact["name"] == "left_arm/skin/touch_4"
    assert contact["position"] == {"x": TOUCH.detection.x, "y": TOUCH.detection.y, "z": 0}
    assert contact["normal"] == {"x": 0, "y": 0, "z": 1}
    told = json.loads(messages["rt/left_arm/touches"]["value"]["data"])
    stamp = contact["header"]["stamp"]
    assert stamp["sec"] + 1e-9 * stamp["nanosec"] > EPOCH
    assert told["touches"][0]["id"] == 4
    assert told["utc_s"] == pytest.approx(messages["rt/left_arm/touches"]["stamp"] / 1e9, abs=1e-5)
    cloud = messages["rt/left_arm/points"]["value"]
    assert [field["name"] for field in cloud["fields"]] == ["x", "y", "z", "change"]
    assert cloud["width"] == len(MESH.cells)
    (status,) = messages["rt/diagnostics"]["value"]["status"]
    assert (status["level"], status["message"]) == (0, "OK")
    raw = messages["rt/left_arm/voltages"]["value"]
    count = PATTERN.n_meas
    assert [(dim["size"], dim["stride"]) for dim in raw["layout"]["dim"]] == [
        (2, 2 * count), (count, count),
    ]  # fmt: skip
    assert raw["data"] == [*(np.arange(count) + 0.25), *range(count)]
    rows = json.loads(messages["rt/left_arm/rows"]["value"]["data"])["measurements"]
    assert (len(rows), rows[0]) == (count, "E2-E1 E3-E4")
    (frame,) = messages["rt/tf"]["value"]["transforms"]
    track = messages["rt/left_arm/track"]["value"]
    assert frame["child_frame_id"] == track["child_frame_id"] == "left_arm/skin/touch_4"
    assert frame["transform"]["translation"] == track["pose"]["pose"]["position"]
    assert frame["transform"]["rotation"] == track["pose"]["pose"]["orientation"]
    (transform,) = messages["rt/tf_static"]["value"]["transforms"]
    assert (transform["header"]["frame_id"], transform["child_frame_id"]) == (
        "tool0", "left_arm/skin",
    )  # fmt: skip
    assert transform["transform"]["translation"]["z"] == 0.05


def test_a_subscriber_that_reads_no_more_delays_nobody(program, domain, sink):
    peer = program(str(PEER), domain)
    heard_by(peer, sink, len(TOPICS))
    peer.send(signal.SIGSTOP)
    begun = time.monotonic()
    for number in range(40):
        publish(sink, 1000 + number)
    assert time.monotonic() - begun < PATIENCE  # none stands still for ever, and none raises
    peer.send(signal.SIGCONT)
    peer.hears(lambda n: publish(sink, 2000 + n))


def test_what_nobody_reads_is_not_made(sink, monkeypatch):
    for name in ("contacts", "wrench", "track", "markers", "voltages", "image", "points"):
        monkeypatch.setattr(ros_fields, name, lambda *_: pytest.fail("made for nobody"))
    publish(sink, 0)


def test_the_report_of_a_run_says_how_its_board_is(program, domain, prepared, idle):
    peer, board = program(str(PEER), domain), Board(free=idle, period=0.02)
    board.number = bytes.fromhex("0102030405060708")
    runner = Runner(prepared, board.open, sinks=[make_sink("ros2")])
    runner.start()
    try:
        for text in peer.lines(lambda _: None):
            line = json.loads(text)
            if line.get("heard") != "rt/diagnostics":
                continue
            (status,) = line["value"]["status"]
            told = {row["key"]: row["value"] for row in status["values"]}
            if status["level"] == 0 and float(told["frames_per_s"]):
                break
        said = [e.text for e in runner.events.since(0)[1] if e.kind == "sink-open"]
    finally:
        runner.stop()
    assert told["board"] == "0102030405060708"
    assert told["firmware"] == "1.2.3"
    assert 1 < float(told["frames_per_s"]) < 60
    assert (told["corrupt"], told["missing"], told["electrodes"]) == ("0", "0", "good")
    assert told["parent"].startswith("none")
    assert 'no parent of its frame "skin" is published' in said[0]


def asked(domain, service, kind="std_srvs/Trigger", **fields):
    """The reply that a node gets from a service."""
    fields = fields or {"structure_needs_at_least_one_member": 0}
    command = [sys.executable, str(CLIENT), domain, service, kind, json.dumps(fields)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=PATIENCE)
    return json.loads(done.stdout)


def test_nodes_ask_for_a_reference_and_for_recordings(domain, prepared, idle, tmp_path):
    board = Board(free=idle, period=0.02)
    runner = Runner(prepared, board.open, sinks=[make_sink(f"ros2:folder={tmp_path}")])
    runner.start()
    try:
        with LiveSkin(runner) as skin:
            while not skin.wait(PATIENCE).valid:
                pass
            reply = asked(domain, "/tomoskin/take_reference")
            assert reply["success"]
            assert "do not touch the skin" in reply["message"]
            assert reply["ends"][0] == reply["ends"][1]  # which of the ends belong together
            assert reply["ends"][0].startswith("serviceid=")
            started = asked(domain, "/tomoskin/start_recording")
            assert started["success"]
            (file,) = tmp_path.glob("*.mcap")
            assert started["message"] == f"recording to {file}"
            again = asked(domain, "/tomoskin/start_recording")
            assert not again["success"]
            assert "stop it first" in again["message"]
            assert asked(domain, "/tomoskin/stop_recording")["message"] == f"{file} is complete"
            nothing = asked(domain, "/tomoskin/stop_recording")
            assert nothing["message"] == "nothing was being recorded"
        with SessionReader(file) as session:
            assert len([*session.frames()]) > 0
            assert not session.torn
    finally:
        runner.stop()


@pytest.mark.parametrize(("release", "size"), [("jazzy", 16), ("humble", 24)])
def test_the_graph_has_a_node_with_its_topics_and_services(program, domain, stream, release, size):
    sink = make_sink(f"ros2:namespace=left/arm,release={release}")
    begin(sink, replace(stream, obey=print))
    for text in program(str(GRAPH), domain, f"ROS2_{release.upper()}").lines(lambda _: None):
        line = json.loads(text)
        if "" not in line["topics"]:  # all its ends have been discovered
            break
    sink.close()
    assert (line["node"], line["size"]) == (["/left", "arm"], size)
    assert line["own"]
    own = {f"rt{name}" if name[0] == "/" else f"rt/left/arm/{name}" for name in TOPICS}
    services = {"take_reference", *PARAMETERS}
    own |= {f"rq/left/arm/{name}Request" for name in services}
    own |= {f"rr/left/arm/{name}Reply" for name in services}
    assert set(line["topics"]) == own


def test_parameters_can_be_read_and_not_set(domain, stream):
    sink = make_sink("ros2:parent=tool0")
    begin(sink, stream)

    def parameters(does, **fields):
        name = does.replace("P", "_p").lower()
        return asked(domain, f"/tomoskin/{name}", f"rcl_interfaces/{does}", **fields)

    names = parameters("ListParameters", prefixes=[], depth=0)["result"]["names"]
    assert names == ["skin", "source", "frame_id", "parent", "electrodes", "measurements"]
    some = parameters("ListParameters", prefixes=["skin"], depth=0)["result"]["names"]
    assert some == ["skin"]
    got = parameters("GetParameters", names=["skin", "electrodes", "none", "parent"])["values"]
    assert [(v["type"], v["string_value"], v["integer_value"]) for v in got] == [
        (4, stream.skin, 0), (2, "", 8), (0, "", 0), (4, "tool0", 0),
    ]  # fmt: skip
    (described,) = parameters("DescribeParameters", names=["electrodes"])["descriptors"]
    assert (described["name"], described["type"], described["read_only"]) == ("electrodes", 2, True)
    assert described["description"] == "Number of electrodes"
    (refused,) = parameters("SetParameters", parameters={"skin": "other"})["results"]
    assert not refused["successful"]
    assert "read-only" in refused["reason"]
    assert parameters("GetParameters", names=["skin"])["values"][0]["string_value"] == stream.skin
    sink.close()


def test_without_a_folder_nobody_may_have_it_record(domain, prepared, idle):
    runner = Runner(prepared, Board(free=idle).open, sinks=[make_sink("ros2")])
    runner.start()
    try:
        assert asked(domain, "/tomoskin/take_reference")["success"]
        participant = DomainParticipant(int(domain))
        topics = BuiltinDataReader(participant, BuiltinTopicDcpsSubscription)
        names = set()
        while "rq/tomoskin/take_referenceRequest" not in names:
            names |= {found.topic_name for found in topics.take(N=100)}
            time.sleep(0.05)
    finally:
        runner.stop()
    assert not any("recording" in name for name in names)


def test_a_sink_may_be_opened_again(sink, stream):
    sink.close()
    sink.close()
    contacts_at = begin(sink, stream)
    sink.publish(contacts_at(0.25, TOUCH))


def test_the_listener_of_the_documentation_hears_touches(listener, domain, stream):
    own = ("DomainParticipant(0)", f"DomainParticipant({domain})")
    heard = listener("extras/ros2.md", "cyclonedds", domain=own)
    sink = make_sink("ros2")
    contacts_at = begin(sink, stream)
    line = heard.hears(lambda number: sink.publish(contacts_at(float(number), TOUCH)))
    sink.close()
    assert line.strip() == "4 [0.1, -0.2, 0.0]"


@pytest.mark.parametrize(
    ("argument", "said"),
    [
        ("node", "expected domain=…, namespace=…, frame=…, parent=…, at=…, folder=…, release=…"),
        ("namespace=left arm", "expected a namespace"),
        ("namespace=/arm", "expected a namespace"),
        ("frame=", "expected domain"),
        ("release=foxy", "expected release=jazzy or humble, got .foxy."),
        ("domain=233", "expected a domain from 0 to 232"),
        ("domain=x", "expected a domain"),
        ("at=0/0/0", "expected parent"),
        ("folder=/no/such/folder", "expected a folder that exists"),
        ("parent=tool0,at=0/0", "at: expected X/Y/Z"),
        ("parent=tool0,at=0/0/nan", "at: expected X/Y/Z"),
        ("parent=tool0,at=a/b/c", "at: expected X/Y/Z"),
    ],
)
def test_what_cannot_be_meant(argument, said):
    with pytest.raises(SinkError, match=said):
        make_sink(f"ros2:{argument}")


def test_the_domain_is_the_environments(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert make_sink("ros2").name == "ros2 /tomoskin, domain 7"
    assert make_sink("ros2:domain=3,namespace=left_arm").name == "ros2 /left_arm, domain 3"


def test_without_a_network_it_is_said(monkeypatch, stream):
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK.replace("'lo'", "'no-such-interface'"))
    sink = make_sink("ros2:domain=99")
    with pytest.raises(SinkError, match=r"cannot join domain 99.*CYCLONEDDS_URI"):
        begin(sink, stream)
    sink.close()
