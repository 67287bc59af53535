"""A board for tests: speaks the protocol, and sends what the test says when it says so."""

from __future__ import annotations

import threading
from collections import deque
from itertools import count

import numpy as np

from tomoskin.board.wire import (
    OLDER,
    SCHEMA,
    Ack,
    Deframer,
    GetInfo,
    Hello,
    Info,
    Ping,
    Reset,
    Result,
    SetScan,
    Start,
    Stop,
    decode_payload,
    encode,
    type_byte,
)
from tomoskin.core import Frame, SourceError

VERSION, HASH = min(OLDER.items())
"""Of the first protocol: then nothing is read back that it would have to hold."""

AS_TAKEN = {"baseline": "hold", "common_modes": "kept"}
"""[signal] of a skin whose pictures are those of its operator alone."""


class Board:
    """Transport whose other end is here.

    With ``free`` samples it scans by itself, a frame every ``period`` s at most. Its clock goes
    on by ``tick`` with each frame, 10 ms as a rule.
    """

    def __init__(self, free=None, period=0.002):
        self.name = "board on the table"
        self.free = free
        self.presses = ()
        self.number = bytes(8)
        self.commands = []
        self.lost = False
        self.tick = 160_000
        self.closed = False
        self.scanning = threading.Event()
        self.sought = threading.Semaphore(0)
        self.period = period
        self._configuration = 0
        self._sequence = count()
        self._out = deque([encode(Hello(*VERSION, HASH))])
        self._news = threading.Condition()
        self._deframer = Deframer(SCHEMA.to_device_bytes)

    def open(self):
        """Itself, until its cable is pulled: then it is ``sought`` in vain."""
        if self.lost:
            self.sought.release()
            raise SourceError("the port is gone", where="port")
        return self

    def set_presses(self, presses):
        self.presses = presses

    def write(self, data):
        self._check()
        for payload in self._deframer.feed(data):
            command = decode_payload(payload, 0.0)
            self.commands.append(command)
            if isinstance(command, Ping):
                continue  # a late test is no board that has stopped: it is not set up again
            self.raw(self._answer(command))
            if isinstance(command, Start):  # frames come after the answer
                self.scanning.set()

    def read(self, timeout):
        self._check()
        if self.free is not None and self.scanning.is_set():
            threading.Event().wait(self.period)
            self.send(self.free)
        with self._news:
            self._news.wait_for(lambda: self._out or self.lost, timeout)
            self._check()
            data = b"".join(self._out)
            self._out.clear()
        return data

    def close(self):
        self.closed = True

    def send(self, samples, *, drops=0, skip=0, flags=0):
        """One frame, after leaving ``skip`` out."""
        for _ in range(skip):
            next(self._sequence)
        number = next(self._sequence)
        ticks = number * self.tick
        frame = Frame(number, ticks, 0.0, self._configuration, flags, drops, samples.astype("<u2"))
        self.raw(encode(frame))

    def raw(self, data):
        """Any bytes."""
        with self._news:
            self._out.append(data)
            self._news.notify()

    def lose(self):
        """The cable is pulled."""
        with self._news:
            self.lost = True
            self._news.notify()

    def _check(self):
        if self.lost:
            raise SourceError("the device has been disconnected", where=self.name)

    def _answer(self, command):
        if isinstance(command, GetInfo):
            return encode(
                Info(
                    request=command.request,
                    major=VERSION[0],
                    minor=VERSION[1],
                    schema_hash=HASH,
                    firmware=bytes((1, 2, 3)),
                    reset=Reset.POWER,
                    channels=16,
                    adc_bits=10,
                    max_oversampling=64,
                    max_drives=256,
                    max_samples=2000,
                    tick_rate=16_000_000,
                    current=1000,
                    max_baud=115200,
                    unique_id=self.number,
                )
            )
        if isinstance(command, SetScan):
            self._configuration = command.configuration
        if isinstance(command, Start) and not self.scanning.is_set():  # no repeated one
            self._sequence = count()
        if isinstance(command, Stop):
            self.scanning.clear()
        return encode(Ack(command.request, type_byte(type(command)), Result.OK, 0))


def samples_of(prepared, conductivity=None):
    """(n_samples,) counts that a noiseless board reads at a conductivity (n_cells,) S."""
    sigma = prepared.skin.conductivity if conductivity is None else conductivity
    potentials = prepared.model.solve(sigma).electrode_potentials
    settings, scan = prepared.skin.readout, prepared.scan
    ground = potentials[scan.sample_drive, scan.drives[scan.sample_drive, 1]]
    potential = potentials[scan.sample_drive, scan.sample_electrode] - ground
    volts = settings.gain * potential + settings.offset
    full = settings.oversampling * (2**settings.adc_bits - 1)
    return np.round(volts / settings.reference_voltage * full).astype(np.uint16)


def pressed(prepared, x, y, loss=0.5, radius=0.02):
    """(n_cells,) S with a round touch at (x, y)."""
    sigma = np.full(len(prepared.mesh.cells), prepared.skin.conductivity)
    near = np.hypot(*(prepared.mesh.centroids - (x, y)).T) <= radius
    sigma[near] *= 1 - loss
    return sigma
