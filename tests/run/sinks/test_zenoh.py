"""The Zenoh sink, met by a subscriber on this machine; nobody else is searched for."""

from __future__ import annotations

import contextlib
import queue

import pytest
import zenoh
from zenoh import ext

from files.session.runs import TOUCH
from run.sinks.conftest import EPOCH, EVENT, PATIENCE, free_port, moment_at
from run.sinks.test_ros import Cdr
from tomoskin.core import SinkError
from tomoskin.run.sinks import make_sink


@pytest.fixture(scope="module")
def peer():
    """(endpoint, session) of a peer that listens on loopback only."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("listen/endpoints", f'["{endpoint}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        yield endpoint, session


@pytest.fixture
def heard(peer):
    samples = queue.SimpleQueue()
    subscriber = peer[1].declare_subscriber("**/tomoskin/**", samples.put)
    yield lambda: samples.get(timeout=PATIENCE)
    subscriber.undeclare()


@pytest.mark.parametrize("domain", [None, 7])
def test_a_subscriber_gets_ros_messages(peer, heard, stream, domain):
    options = "" if domain is None else f",domain={domain},namespace=left/tomoskin"
    sink = make_sink(f"zenoh:{peer[0]}{options}")
    sink.open(stream)
    sink.publish(moment_at(0.25, TOUCH))
    sink.publish(EVENT)
    samples = [heard() for _ in range(8)]
    sink.close()
    keys = [str(sample.key_expr) for sample in samples]
    pose = Cdr(samples[0].payload.to_bytes())
    pose.header()
    assert pose.take("d") == TOUCH.detection.x
    if domain is None:
        names = ["touch", "track", "touches", "contacts", "wrench", "markers", "image", "events"]
        assert keys == [f"tomoskin/{name}" for name in names]
        return
    assert keys[-1] == (
        "7/left/tomoskin/events/std_msgs::msg::dds_::String_/"
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )
    layout = tuple[str, ext.Int64, str, ext.Int64, str, list[ext.UInt8]]
    told = ext.z_deserialize(layout, samples[0].attachment)
    assert told[:4] == ("sequence_number", 1, "source_timestamp", round((EPOCH + 0.25) * 1e9))
    assert (told[4], len(told[5])) == ("source_gid", 16)


def test_an_endpoint_that_does_not_answer_is_said(stream, monkeypatch):
    sink = make_sink(f"zenoh:tcp/127.0.0.1:{free_port()}")
    monkeypatch.setattr("tomoskin.run.sinks.zenoh._PATIENCE", 200)
    with pytest.raises(SinkError, match="cannot be joined"):
        sink.open(stream)
    sink.close()


def test_the_listener_of_the_documentation_hears_touches(listener, stream):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = (
        f'zenoh.Config.from_json5(\'{{mode: "peer", listen: {{endpoints: ["{endpoint}"]}}, '
        "scouting: {multicast: {enabled: false}}}')"
    )
    heard = listener("zenoh", config=("zenoh.Config()", config))
    opened = []

    def publish(number):
        if not opened:
            with contextlib.suppress(SinkError):  # it does not listen yet
                sink = make_sink(f"zenoh:{endpoint}")
                sink.open(stream)
                opened.append(sink)
        for sink in opened:
            sink.publish(moment_at(float(number), TOUCH))

    line = heard.hears(publish)
    opened[0].close()
    assert line.strip() == "[(4, 0.1, -0.2)]"
