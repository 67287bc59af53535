"""The MQTT sink, before a real broker on this machine."""

from __future__ import annotations

import contextlib
import json
import queue
import shutil
import socket
import ssl
import subprocess
import time
import types
from contextlib import contextmanager
from dataclasses import replace

import pytest
from paho.mqtt import client as paho

from conftest import missing
from files.session.runs import FOLD, TOUCH
from run.sinks.conftest import (
    EPOCH,
    EVENT,
    PATIENCE,
    begin,
    free_port,
    listener,
    program,
    result_at,
    stream,
    touch_of,
)
from tomoskin.core import Event, SinkError
from tomoskin.extras.mqtt import mqtt_sink
from tomoskin.extras.mqtt.mqtt_sink import PERIOD
from tomoskin.files.messages import Reporter
from tomoskin.run.sinks import make_sink
from tomoskin.sensing.track import TouchEvent

__all__ = ["listener", "program", "stream"]

BROKERS = "/usr/sbin:/usr/local/sbin:/opt/homebrew/sbin"


class Broker:
    """mosquitto on a port of its own, for ``me`` with the password ``secret``."""

    def __init__(self, folder, program, *more):
        self.port = free_port()
        self._program, self._folder = program, folder
        people = folder / "people"
        people.write_text("me:secret\n")
        people.chmod(0o600)
        command = [shutil.which("mosquitto_passwd") or "mosquitto_passwd", "-U", str(people)]
        subprocess.run(command, check=True, capture_output=True)
        lines = f"listener {self.port} 127.0.0.1\npassword_file {people}\nuser root\n"
        (folder / "broker.conf").write_text("\n".join([lines, *more, ""]))
        self.start()

    @property
    def url(self):
        return f"mqtt://me:secret@127.0.0.1:{self.port}/robot/skin"

    def start(self):
        command = [self._program, "-c", str(self._folder / "broker.conf")]
        self._process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
                return
            except ConnectionRefusedError:
                assert self._process.poll() is None

    def stop(self):
        self._process.terminate()
        self._process.wait(PATIENCE)


@pytest.fixture
def mosquitto():
    program = shutil.which("mosquitto") or shutil.which("mosquitto", path=BROKERS)
    if program is None:
        missing("the MQTT sink: no mosquitto (Debian: apt-get install mosquitto)")
    return program


@pytest.fixture
def broker(tmp_path, mosquitto):
    broker = Broker(tmp_path, mosquitto)
    yield broker
    broker.stop()


@contextmanager
def subscribed(broker):
    """The messages that a subscriber gets, one after the other; it speaks MQTT 3.1.1."""
    came, ready = queue.SimpleQueue(), queue.SimpleQueue()
    client = paho.Client(paho.CallbackAPIVersion.VERSION2)
    client.username_pw_set("me", "secret")
    client.on_message = lambda *told: came.put(told[2])
    client.on_subscribe = lambda *_: ready.put(None)
    client.connect("127.0.0.1", broker.port)
    client.loop_start()
    client.subscribe("robot/#", qos=1)
    ready.get(timeout=PATIENCE)
    yield came
    client.disconnect()
    client.loop_stop()


@pytest.fixture
def heard(broker):
    """The next (topic, content) that a subscriber gets."""
    with subscribed(broker) as came:

        def hear():
            message = came.get(timeout=PATIENCE)
            return message.topic, message.payload.decode()

        yield hear


def test_touches_events_and_status(broker, heard, stream):
    sink = make_sink(broker.url)
    contacts_at = begin(sink, stream)
    assert heard() == ("robot/skin/status", "online")
    sink.publish(replace(contacts_at(1.0, TOUCH, sequence=3), deformation=FOLD))
    topic, text = heard()
    assert topic == "robot/skin/touches"
    told = json.loads(text)
    assert (told["sequence"], told["touches"][0]["x"]) == (3, TOUCH.detection.x)
    assert told["touches"][0]["sd_y"] is None
    assert (told["valid"], told["deformation"]["kind"]) == (True, "fold")
    assert told["deformation"]["offset"] == {"value": 0.02, "low": 0.015, "high": 0.025}
    assert told["touches"][0]["position"] == [TOUCH.detection.x, TOUCH.detection.y, 0.0]
    assert (told["skin"], told["frame_id"]) == (stream.skin, "robot/skin/skin")
    assert told["utc_s"] == EPOCH + told["host_time"]
    begun = TouchEvent("onset", TOUCH, 1.1)
    sink.publish(replace(contacts_at(1.1, TOUCH, sequence=4), happened=(begun,)))
    topic, text = heard()
    assert topic == "robot/skin/touch"
    told = json.loads(text)
    assert (told["event"], told["id"], told["time_s"]) == ("onset", TOUCH.id, 1.1)
    assert (told["utc_s"], told["normal"]) == (EPOCH + 1.1, [0, 0, 1])
    assert heard()[0] == "robot/skin/touches"
    sink.publish(EVENT)
    topic, text = heard()
    assert topic == "robot/skin/events"
    assert text.startswith('{"time_s":0.5,"kind":"connected","text":"board 01","utc_s":')
    sink.close()
    assert heard() == ("robot/skin/status", "offline")


def test_beginnings_and_ends_are_sent_at_once_the_rest_now_and_then(broker, heard, stream):
    sink = make_sink(broker.url)
    begin(sink, stream)
    heard()
    one, two = touch_of(1), touch_of(2)
    reporter = Reporter(stream.named(sink.naming), period=sink.period)
    for number, touches in enumerate(((), (one,), (one,), (one, two), (one, two), (), ())):
        sink.publish(reporter.of(result_at(0.01 * number, *touches, sequence=number)))
    sink.publish(reporter.of(result_at(1.0, one, sequence=7)))
    sink.publish(reporter.of(result_at(1.0 + 1.01 * PERIOD, one, sequence=8)))
    assert [json.loads(heard()[1])["sequence"] for _ in range(6)] == [0, 1, 3, 5, 7, 8]
    sink.close()


def test_a_deformation_is_told_at_once_and_while_it_lasts(broker, heard, stream):
    sink = make_sink(broker.url)
    begin(sink, stream)
    heard()
    reporter = Reporter(stream.named(sink.naming), period=sink.period)
    for number, told in enumerate((None, FOLD, FOLD, None, None)):
        result = result_at(0.01 * number, sequence=number, deformation=told)
        sink.publish(reporter.of(result))
    sink.publish(reporter.of(result_at(0.1, sequence=5, deformation=FOLD)))
    sink.publish(reporter.of(result_at(0.1 + 1.01 * PERIOD, sequence=6, deformation=FOLD)))
    sent = [json.loads(heard()[1]) for _ in range(5)]
    assert [one["sequence"] for one in sent] == [0, 1, 3, 5, 6]
    assert [bool(one["deformation"]) for one in sent] == [False, True, False, True, True]
    sink.close()


def test_a_lost_board_is_told_and_kept_until_frames_come_again(broker, heard, stream):
    sink = make_sink(broker.url)
    begin(sink, stream)
    reporter = Reporter(stream.named(sink.naming), period=sink.period)
    sink.publish(reporter.of(result_at(1.0, TOUCH)))
    assert [heard()[0] for _ in range(2)] == ["robot/skin/status", "robot/skin/touches"]
    sink.publish(reporter.lost(Event(1.2, "source-lost", "the cable is out")))
    sink.publish(reporter.silent())
    assert heard() == ("robot/skin/status", "offline")
    topic, text = heard()
    told = json.loads(text)
    assert topic == "robot/skin/touches"
    assert (told["valid"], told["problem"], told["touches"]) == (False, "the cable is out", [])
    sink.publish(reporter.of(result_at(2.0)))
    assert heard() == ("robot/skin/status", "online")
    sink.close()


def happening(contacts, kind):
    event = TouchEvent(kind, TOUCH, contacts.host_time)
    return replace(contacts, happened=(event,), is_due=False)


def test_all_that_happens_to_a_touch_but_a_move_is_acknowledged(broker, stream):
    sink = make_sink(broker.url)
    contacts_at = begin(sink, stream)
    with subscribed(broker) as came:
        for kind in ("onset", "move", "release"):
            sink.publish(happening(contacts_at(1.0, TOUCH), kind))
        heard = [came.get(timeout=PATIENCE) for _ in range(4)]
    told = [(m.topic.rpartition("/")[2], m.qos) for m in heard]
    assert told == [("status", 1), ("touch", 1), ("touch", 0), ("touch", 1)]
    sink.close()


def test_an_onset_outlasts_a_broker_that_was_away(broker, stream):
    sink = make_sink(broker.url)
    contacts_at = begin(sink, stream)
    broker.stop()
    with contextlib.suppress(SinkError):  # the client may have noticed, or not
        sink.publish(happening(contacts_at(1.0, TOUCH), "onset"))
    sink.close()
    broker.start()
    with subscribed(broker) as came:
        begin(sink, stream)
        heard = [came.get(timeout=PATIENCE) for _ in range(2)]
        assert [m.topic for m in heard] == ["robot/skin/status", "robot/skin/touch"]
        assert json.loads(heard[1].payload)["event"] == "onset"
        sink.close()
        begin(sink, stream)  # it has arrived, and does not come again
        sink.close()
        rest = [came.get(timeout=PATIENCE).payload for _ in range(3)]
    assert rest == [b"offline", b"online", b"offline"]


class Link:
    """A client whose link goes after some messages, which arrive."""

    def __init__(self, lasts):
        self.lasts, self.arrived = lasts, []

    def publish(self, _topic, data="", *_more, **_about):
        came = len(self.arrived) < self.lasts
        if came:
            self.arrived.append(data)
        return types.SimpleNamespace(rc=0 if came else 4, is_published=lambda: came)


@pytest.mark.parametrize("lasts", [0, 1, 3])
def test_what_is_owed_outlasts_a_link_that_goes_while_it_is_sent_again(stream, lasts):
    sink = make_sink("mqtt://127.0.0.1/robot/skin")
    sink._stream, sink._client = stream, Link(0)
    owed = [f"onset {n}".encode() for n in range(5)]
    for data in owed:
        with pytest.raises(SinkError):
            sink._put("touch", data, qos=1)
    links = Link(lasts), Link(99)
    sink._client = links[0]
    with pytest.raises(SinkError):
        sink._pay()
    sink._client = links[1]
    sink._pay()
    assert [*links[0].arrived, *links[1].arrived] == owed
    sink._client = Link(99)
    sink._pay()
    assert sink._client.arrived == []


def test_who_comes_later_gets_the_touches_until_they_are_old(broker, stream, monkeypatch):
    monkeypatch.setattr(mqtt_sink, "_EXPIRY", 2)
    sink = make_sink(broker.url)
    contacts_at = begin(sink, stream)
    sink.publish(contacts_at(1.0, TOUCH))
    sink.close()
    published = time.monotonic()
    with subscribed(broker) as came:
        kept = [came.get(timeout=PATIENCE) for _ in range(2)]
    assert {m.topic for m in kept} == {"robot/skin/status", "robot/skin/touches"}
    assert all(m.retain for m in kept)
    time.sleep(max(0.0, published + 4.0 - time.monotonic()))
    with subscribed(broker) as came:
        assert came.get(timeout=PATIENCE).topic == "robot/skin/status"
        with pytest.raises(queue.Empty):
            came.get(timeout=0.5)


@pytest.fixture
def authority(tmp_path):
    """An authority that has signed a certificate of this machine."""
    if shutil.which("openssl") is None:
        missing("TLS of the MQTT sink: no openssl (Debian: apt-get install openssl)")

    def openssl(*words):
        subprocess.run(["openssl", *words], check=True, capture_output=True, cwd=tmp_path)

    new = ("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2")
    openssl(*new, "-subj", "/CN=authority", "-keyout", "ca.key", "-out", "ca.pem")
    openssl(
        *new, "-subj", "/CN=broker", "-addext", "subjectAltName=IP:127.0.0.1",
        "-addext", "basicConstraints=CA:FALSE",
        "-CA", "ca.pem", "-CAkey", "ca.key", "-keyout", "broker.key", "-out", "broker.pem",
    )  # fmt: skip
    return tmp_path / "ca.pem"


# the library leaves the socket of a refused broker to the collector of garbage
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_it_trusts_a_broker_by_its_authority_alone(tmp_path, mosquitto, authority, stream):
    lines = f"certfile {tmp_path}/broker.pem", f"keyfile {tmp_path}/broker.key"
    broker = Broker(tmp_path, mosquitto, *lines)
    try:
        sink = make_sink(f"{broker.url}?tls={authority}")
        assert sink.name == f"mqtts://127.0.0.1:{broker.port}/robot/skin"
        contacts_at = begin(sink, stream)
        sink.publish(contacts_at(1.0, TOUCH))
        sink.close()
        stranger = make_sink(f"{broker.url}?tls=system")
        with pytest.raises(ssl.SSLError, match="CERTIFICATE_VERIFY_FAILED"):
            begin(stranger, stream)
        stranger.close()
    finally:
        broker.stop()
    with pytest.raises(
        SinkError, match="expected tls=system, or the file of an authority that exists"
    ):
        make_sink(f"{broker.url}?tls={tmp_path}/none.pem")


def test_a_message_does_not_wait_for_the_one_before_to_be_acknowledged(broker, stream):
    sink = make_sink(broker.url)
    sink.open(stream)
    own = sink._client.socket()
    assert own.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
    sink.close()


def test_a_wrong_password_is_said(broker, stream):
    sink = make_sink(broker.url.replace("secret", "guess"))
    with pytest.raises(SinkError, match="refused"):
        begin(sink, stream)
    sink.close()


def test_a_broker_that_goes_is_noticed(broker, heard, stream, monkeypatch):
    sink = make_sink(broker.url)
    begin(sink, stream)
    heard()
    broker.stop()
    deadline = time.monotonic() + PATIENCE

    def go_on():
        while time.monotonic() < deadline:
            sink.publish(EVENT)

    with pytest.raises(SinkError, match=f"127.0.0.1:{broker.port}/robot/skin"):
        go_on()
    # it may have gone between the question whether it is there and the last word
    monkeypatch.setattr(sink._client, "is_connected", lambda: True)
    sink.close()
    with pytest.raises(OSError, match="refused"):
        begin(sink, stream)
    sink.close()


def test_the_listener_of_the_documentation_hears_touches(broker, listener, stream):
    place = f'client.username_pw_set("me", "secret")\nclient.connect("127.0.0.1", {broker.port})'
    heard = listener("extras/mqtt.md", "paho", place=('client.connect("127.0.0.1", 1883)', place))
    sink = make_sink(broker.url)
    contacts_at = begin(sink, stream)
    line = heard.hears(lambda number: sink.publish(contacts_at(float(number), TOUCH)))
    sink.close()
    assert line.split() == ["4", "0.1", "-0.2"]
