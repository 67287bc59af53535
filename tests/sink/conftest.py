"""A stream of the textile disc, moments of it, and a run of an outlet."""

from __future__ import annotations

import socket
import threading
from dataclasses import replace

import numpy as np
import pytest

from session.runs import SKIN, TOUCH
from tomoskin.core import Event, Image
from tomoskin.sink import Moment, Stream

PATIENCE = 20
EPOCH = 1_700_000_000.0
MESH = SKIN.mesh()
PATTERN = SKIN.pattern()
VALUES = np.linspace(-1, 1, len(MESH.cells))
EVENT = Event(0.5, "connected", "board 01")
STREAM = Stream(SKIN.name, "twin of textile-disc-8", PATTERN, MESH.pixels(48), EPOCH)


def moment_at(host_time, *touches, sequence=0):
    """Results of one frame, with an image."""
    rows = np.arange(PATTERN.n_meas, dtype=float)
    image = Image(VALUES, "S", MESH.identity)
    return Moment(sequence, host_time, True, rows + 0.25, rows, touches, image)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def touch_of(number):
    return replace(TOUCH, id=number)


@pytest.fixture
def stream():
    return STREAM


class News:
    """What an outlet says, and a way to wait for something to be true."""

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
