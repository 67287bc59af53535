"""LSL outlets, met by an inlet on this machine."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

CONFIGURATION = """\
[multicast]
ResolveScope = machine
AddressesOverride = {127.0.0.1}
[ports]
MulticastPort = 16599
"""

RUN = """
import json, math, time
import pylsl
from dataclasses import replace
from files.session.runs import FOLD, TOUCH
from run.sinks.conftest import EVENT, begin
from tomoskin.run.sinks import make_sink

sink = make_sink("lsl:try")
contacts_at = begin(sink)
found = {}
for name in ("voltages", "dv", "touches", "deformation", "events"):
    (info,) = pylsl.resolve_byprop("name", f"try-{name}", timeout=20)
    found[name] = pylsl.StreamInlet(info)
    found[name].open_stream(20)
before = time.monotonic()
sink.publish(replace(contacts_at(before, TOUCH), deformation=FOLD))
sink.publish(EVENT)
rows = {name: inlet.pull_sample(20)[0] for name, inlet in found.items()}
stamp = found["voltages"]
info = stamp.info()
channel = info.desc().child("channels").child("channel")
sink.publish(contacts_at(before + 1.0))
_, time_ = stamp.pull_sample(20)
earliest = pylsl.local_clock() - time.monotonic()
now = time.monotonic()
latest = pylsl.local_clock() - now
print(json.dumps({
    "voltages": rows["voltages"], "dv": rows["dv"], "event": rows["events"],
    "touches": [None if math.isnan(v) else v for v in rows["touches"]],
    "deformation": rows["deformation"][:6],
    "label": channel.child_value("label"), "unit": channel.child_value("unit"),
    "ahead": time_ - (before + 1.0), "between": [earliest, latest],
}))
sink.close()
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What an inlet got, in a process of its own: liblsl reads its configuration once."""
    folder = tmp_path_factory.mktemp("lsl")
    configuration = folder / "lsl.cfg"
    configuration.write_text(CONFIGURATION)
    tests = Path(__file__).resolve().parents[2]
    paths = os.pathsep.join(filter(None, (str(tests), os.environ.get("PYTHONPATH"))))
    environment = os.environ | {"LSLAPICFG": str(configuration), "PYTHONPATH": paths}
    command = [sys.executable, "-c", RUN]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=100, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_voltages_and_their_change(told):
    assert told["voltages"][:2] == [0.25, 1.25]
    assert told["dv"] == [0.25] * 40
    assert (told["label"], told["unit"]) == ("E2-E1 E3-E4", "V")


def test_touches_and_events(told):
    assert told["touches"][:4] == [4, 0.1, -0.2, -0.5]
    assert told["touches"][4:] == [None] * 31 + [1]  # the last says that they are valid
    assert told["event"] == ['{"kind":"connected","text":"board 01"}']


def test_a_deformation_is_a_sample_of_numbers(told):
    assert told["deformation"][:2] == [1, 2]  # a fold, in rad
    assert told["deformation"][2:6] == [0.5, 0.4, 0.6, 0.02]  # its axis, then its offset


def test_time_is_the_frames_on_lsls_clock(told):
    earliest, latest = told["between"]
    assert earliest - 1e-3 < told["ahead"] < latest + 1e-3
