"""What a page may ask for."""

import json

import pytest

from tomoskin.core import WireError
from tomoskin.run import SetPresses, commands
from tomoskin.run.commands import PressRequest
from tomoskin.server.requests import MAX_REQUEST, SetRecording, decode_request

PRESS = {"x": 0.01, "y": -0.02, "force": 3.0, "radius": 0.015}


def test_requests():
    assert decode_request('{"type":"reference"}') == commands.TakeReference()
    assert decode_request('{"type":"pause","on":true}') == commands.SetPause(True)
    assert decode_request('{"type":"record","on":false}') == SetRecording(False)
    assert decode_request('{"type":"note","text":"wet"}') == commands.Note("wet")
    assert decode_request('{"type":"seek","at_s":1.5}') == commands.Seek(1.5)
    assert decode_request('{"type":"step"}') == commands.StepReplay()
    assert decode_request('{"type":"speed","speed":null}') == commands.SetSpeed(None)
    assert decode_request('{"type":"loop","on":true}') == commands.SetLoop(True)
    asked = decode_request(json.dumps({"type": "presses", "presses": [PRESS]}))
    assert asked == SetPresses((PressRequest(**PRESS),))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        "reference",
        "{}",
        '{"type":"format"}',
        '{"type":1}',
        '{"type":"reference","path":"/etc/passwd"}',
        '{"type":"pause"}',
        '{"type":"record","on":true,"path":"x.mcap"}',
        '{"type":"pause","on":"yes"}',
        '{"type":"seek","at_s":-1}',
        '{"type":"seek","at_s":1e999}',
        '{"type":"speed","speed":0}',
        '{"type":"speed","speed":1e9}',
        '{"type":"note","text":""}',
        json.dumps({"type": "note", "text": "x" * 501}),
        '{"type":"presses","presses":[{}]}',
        '{"type":"presses","presses":[' + ",".join([json.dumps(PRESS)] * 9) + "]}",
        json.dumps({"type": "presses", "presses": [PRESS | {"force": -1}]}),
        json.dumps({"type": "presses", "presses": [PRESS | {"force": 1e9}]}),
        json.dumps({"type": "presses", "presses": [PRESS | {"radius": 0}]}),
        json.dumps({"type": "presses", "presses": [PRESS | {"radius": 1e-300, "shape": "finger"}]}),
        json.dumps({"type": "presses", "presses": [PRESS | {"radius": 9e-5}]}),
        json.dumps({"type": "presses", "presses": [PRESS | {"radius": 1.1}]}),
        json.dumps({"type": "presses", "presses": [PRESS | {"angle": 7}]}),
        json.dumps({"type": "presses", "presses": [PRESS | {"x": 10.1}]}),
        json.dumps({"type": "presses", "presses": [PRESS | {"x": float("nan")}]}),
        '{"type":"presses","presses":[{"x":1e999,"y":0,"force":1,"radius":0.01}]}',
        "[" * 3000,
        '{"type":"settings","changes":{"skin":{"name":' + "[" * 400 + "]" * 400 + "}}}",
        "\ud800",
        '{"type":"reference"' + " " * MAX_REQUEST + "}",
    ],
)
def test_malformed(text):
    with pytest.raises(WireError):
        decode_request(text)
