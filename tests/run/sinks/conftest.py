"""A stream of the textile disc, results and moments of it, and a run of a worker."""

from __future__ import annotations

import queue
import re
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from files.session.runs import SKIN, TOUCH
from tomoskin.core import Event, Image
from tomoskin.pipeline import FrameResult
from tomoskin.run.sinks import Contacts, Stream

DOCS = Path(__file__).resolve().parents[3] / "docs"
PATIENCE = 300
EPOCH = 1_700_000_000.0
MESH = SKIN.mesh()
PATTERN = SKIN.pattern()
VALUES = np.linspace(-1, 1, len(MESH.cells))
EVENT = Event(0.5, "connected", "board 01")
STREAM = Stream(SKIN.name, "twin of textile-disc-8", PATTERN, MESH.pixels(48), EPOCH)


SCRIPT = """format = 1
[script]
duration = "700 ms"
lead_in = "1.2 s"
[[press]]
id = "a"
radius = "15 mm"
at = ["20 mm", "-30 mm"]
start = "0 s"
force = "3 N"
hold = "200 ms"
[[mark]]
at = "500 ms"
text = "half"
"""
"""A short press with a note."""


def result_at(host_time, *touches, sequence=0, **changes):
    """What a pipeline makes of one frame, with an image."""
    rows = np.arange(PATTERN.n_meas, dtype=float)
    result = FrameResult(
        sequence=sequence,
        host_time=host_time,
        ready=True,
        has_image=True,
        image=Image(VALUES, "S", MESH.identity),
        voltages=rows + 0.25,
        reference=rows,
        touches=touches,
        left_out=0,
    )
    return replace(result, **changes)


def contacts_at(host_time, *touches, sequence=0, stream=STREAM):
    """One frame as sinks get it, all of it worth a message."""
    return Contacts.of(stream, result_at(host_time, *touches, sequence=sequence))


def begin(sink, stream=STREAM):
    """Open a sink as its worker does; what makes the contacts of its stream."""
    named = stream.named(sink.naming)
    sink.open(named)
    return partial(contacts_at, stream=named)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def touch_of(number):
    return replace(TOUCH, id=number)


@pytest.fixture
def stream():
    return STREAM


class News:
    """What a worker says, and a way to wait for something to be true."""

    def __init__(self):
        self.said = []
        self.changed = threading.Condition()

    def __call__(self, kind, text):
        with self.changed:
            self.said.append((kind, text))
            self.changed.notify_all()

    def kinds(self):
        return [kind for kind, _ in self.said]

    def until(self, true):
        with self.changed:
            assert self.changed.wait_for(true, PATIENCE)


@pytest.fixture
def news():
    return News()


def robot_program(page, library, **changes):
    """A program of a page for robots, by the library that it uses."""
    text = (DOCS / page).read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    (program,) = (
        block for block in blocks if re.search(rf"^(import|from) {library}\b", block, re.M)
    )
    for old, new in changes.values():
        assert old in program
        program = program.replace(old, new)
    return program


class Listener:
    """Python in a process of its own, and the lines that it prints."""

    def __init__(self, *arguments):
        self._process = subprocess.Popen(
            [sys.executable, "-u", *arguments], stdout=subprocess.PIPE, text=True
        )
        self._lines = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            self._lines.put(line)

    def hears(self, publish):
        """The first line, while ``publish(n)`` goes on saying the same: it may not listen yet."""
        return next(self.lines(publish))

    def lines(self, publish):
        """Each line; whenever there is none, ``publish(n)`` once more."""
        deadline = time.monotonic() + 3 * PATIENCE
        number = 0
        while True:
            assert time.monotonic() < deadline
            assert self._process.poll() is None
            try:
                yield self._lines.get(timeout=0.2)
            except queue.Empty:
                publish(number)
                number += 1

    def send(self, number):
        self._process.send_signal(number)

    def stop(self):
        self._process.kill()
        self._process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        self._process.stdout.close()


@pytest.fixture
def program():
    """Start Python with some arguments; it ends with the test."""
    started = []

    def start(*arguments):
        started.append(Listener(*arguments))
        return started[-1]

    yield start
    for one in started:
        one.stop()


@pytest.fixture
def listener(program):
    """Start a program of a page, by the library that it uses; it ends with the test."""
    return lambda page, library, **changes: program("-c", robot_program(page, library, **changes))
