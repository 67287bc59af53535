"""Listens to one sink as a program of others does; nothing of tomoskin is imported.

    python sink_client.py KIND ADDRESS

First a line "ready"; then for each message of touches the time at which it came, the time that it
is of (both s since 1970; NaN where it says none), and whether touches are valid.
"""

import json
import math
import struct
import sys
import time
from dataclasses import dataclass


def say(stamp, valid):
    """One line of a message that came now."""
    sys.stdout.write(f"{time.time():.6f} {stamp:.6f} {int(valid)}\n")
    sys.stdout.flush()


def say_json(text):
    told = json.loads(text)
    say(told["utc_s"], told["valid"])


def ros2(_):
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    @dataclass
    class String(IdlStruct, typename="std_msgs.msg.dds_.String_"):
        data: str

    participant = DomainParticipant(77)
    reader = DataReader(participant, Topic(participant, "rt/tomoskin/touches", String))
    for message in reader.take_iter():
        say_json(message.data)


def mqtt(port):
    import paho.mqtt.client as paho

    client = paho.Client(paho.CallbackAPIVersion.VERSION2)
    client.on_message = lambda *got: say_json(got[2].payload)
    client.connect("127.0.0.1", int(port))
    client.subscribe("tomoskin/touches")
    client.loop_forever()


def foxglove(port):
    from websockets.sync.client import connect

    address = f"ws://127.0.0.1:{port}"
    with connect(address, subprotocols=["foxglove.sdk.v1"], max_size=None, proxy=None) as server:
        for message in server:
            if isinstance(message, bytes):
                if message[0] == 1:
                    say_json(message[struct.calcsize("<BIQ") :])
                continue
            told = json.loads(message)
            if told["op"] == "advertise":
                (number,) = (c["id"] for c in told["channels"] if c["topic"] == "/touches")
                asked = [{"id": 1, "channelId": number}]
                server.send(json.dumps({"op": "subscribe", "subscriptions": asked}))


def lsl(_):
    import pylsl

    (info,) = pylsl.resolve_byprop("name", "tomoskin-touches", timeout=60)
    inlet = pylsl.StreamInlet(info)
    while True:
        sample, stamp = inlet.pull_sample()
        say(time.time() - pylsl.local_clock() + stamp, sample[-1])


def page(address):
    from websockets.sync.client import connect

    with connect(address, max_size=None, proxy=None) as server:
        for message in server:
            if isinstance(message, str) and (told := json.loads(message))["type"] == "state":
                say(math.nan, told["running"])


if __name__ == "__main__":
    kinds = {"ros2": ros2, "mqtt": mqtt, "foxglove": foxglove, "lsl": lsl, "page": page}
    kinds[sys.argv[1]](sys.argv[2])
