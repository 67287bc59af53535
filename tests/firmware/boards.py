"""The firmware as a process on a pty, built with sanitizers, and what tests ask of it."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from tomoskin.board.source import ScanSettings
from tomoskin.board.wire import Decoder, Message, encode
from tomoskin.model.pattern import Pattern, Scan
from tomoskin_emulator.program import build_alone

ROOT = Path(__file__).parents[2]
FIRMWARE = ROOT / "firmware"
TABLE = ROOT / "src" / "tomoskin" / "board" / "source" / "boards.toml"
SCAN = Scan.of(Pattern.adjacent(8))
SETTINGS = ScanSettings(oversampling=4, settling=200e-6, current_limit=0.1, adc_bits=10)
PATIENCE = 300.0
"""Seconds until a test gives up; a board answers within milliseconds."""


def star_counts(oversampling: int, scan: Scan = SCAN) -> list[int]:
    """What a board reads of its star of 1 + e ohm: V = I (1 + sink), source I (sum)."""
    source, sink = scan.drives[scan.sample_drive].T
    volts = 0.1 * (1 + sink + (scan.sample_electrode == source) * (1 + source))
    counts: list[int] = (oversampling * np.floor(volts * 1024 / 5).astype(int)).tolist()
    return counts


def make(*arguments: str, folder: Path = FIRMWARE) -> subprocess.CompletedProcess[str]:
    """Run make there, as if nobody had run make around it."""
    with build_alone():
        return subprocess.run(
            ["make", "--silent", "-C", str(folder), f"BOARDS={TABLE}", *arguments],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "MAKEFLAGS": ""},
        )


def built(target: str, product: str) -> Path:
    """Make ``target`` in firmware/; the file that it makes."""
    made = make(target)
    assert made.returncode == 0, made.stderr
    return ROOT / "build" / "firmware" / product


class Process:
    """A board that runs; ``path`` is its serial port."""

    def __init__(self, program: Path, link: Path, *options: str) -> None:
        self.path = str(link)
        self._process = subprocess.Popen(
            [program, "-l", link, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline().strip() == str(link).encode()

    def kill(self) -> None:
        """Unplug it."""
        self._process.kill()
        self._process.wait()

    def said(self) -> str:
        """What a killed one has said on stderr."""
        said = self._process.stderr.read().decode() if self._process.stderr else ""
        for stream in (self._process.stdout, self._process.stderr):
            assert stream is not None
            stream.close()
        return said

    def end(self) -> None:
        """Unplug it, unless it has ended by itself: then say why."""
        ended = self._process.poll()
        self.kill()
        said = self.said()
        assert ended in (None, -9), said
        assert not said, said


@contextmanager
def running(program: Path, link: Path, *options: str) -> Iterator[Process]:
    """A board, unplugged at the end; whatever it says on stderr fails the test."""
    process = Process(program, link, *options)
    try:
        yield process
    finally:
        process.end()


class Talk:
    """Plain messages with a board."""

    def __init__(self, transport) -> None:
        self.transport = transport
        self._decoder = Decoder()
        self._waiting: list[Message] = []
        self.seen: list[Message] = []

    def say(self, message: Message) -> None:
        self.transport.write(encode(message))

    def next(self, kind: type, timeout: float = PATIENCE):
        """The next message of a kind, the others left out."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            while self._waiting:
                message = self._waiting.pop(0)
                if isinstance(message, kind):
                    return message
            data = self.transport.read(0.1)
            self._waiting += (found := self._decoder.feed(data, time.monotonic()))
            self.seen += found
        raise AssertionError(f"no {kind.__name__} within {timeout} s")

    def ask(self, message: Message, kind: type):
        self.say(message)
        return self.next(kind)
