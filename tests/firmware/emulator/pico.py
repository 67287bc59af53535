"""A Pico on a star of resistors, and what its emulator saw: ``firmware/pico/emulator``."""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tomoskin.board.source import Link, ScanSettings, SerialTransport
from tomoskin.core import Event, Frame
from tomoskin.model.pattern import Scan
from tomoskin_emulator.board_process import BoardProcess, Front, SkinMemory
from tomoskin_emulator.program import PicoPrograms

CURRENT = 0.1
LEVELS, REFERENCE = 4096.0, 3.3
NS_PER_CYCLE = 8
PATIENCE = 60.0
"""s until a test gives up."""


@dataclass(frozen=True)
class Pico:
    """A board that runs; ``seen`` is where its emulator writes what it sees."""

    board: BoardProcess
    seen: Path

    def order(self, word: str) -> None:
        """Move the plug (``unplug``, ``plug``) or have the host not read (``stall``, ``flow``)."""
        stdin = self.board._process.stdin
        assert stdin is not None
        stdin.write(f"{word}\n".encode())
        stdin.flush()

    def watch(self) -> dict[str, Any]:
        """The newest of what was seen; written 50 times a second."""
        found: dict[str, Any] = json.loads(self.seen.read_text(encoding="utf-8"))
        return found

    def until(self, holds: Callable[[dict[str, Any]], bool], timeout: float = PATIENCE) -> None:
        """Wait until ``holds`` of what was seen; AssertionError after ``timeout`` s."""
        end = time.monotonic() + timeout
        while not (self.seen.exists() and holds(self.watch())):
            assert time.monotonic() < end, self.watch()
            time.sleep(0.02)

    def link(self, scan: Scan, settings: ScanSettings) -> Link:
        """A link through its serial port."""
        return Link(SerialTransport(self.board.port), scan, settings)


@contextmanager
def powered(programs: PicoPrograms, folder: Path, *options: str) -> Iterator[Pico]:
    """A Pico on a star of 1 + e ohm; whatever its emulator complains of fails the test."""
    front = Front(CURRENT, 1e9, 1.0, 0.0, REFERENCE, LEVELS, 0.0)
    memory = SkinMemory(folder / "skin", front, np.diag(np.arange(1.0, 33.0)))
    seen = folder / "watch"
    board = BoardProcess(programs, memory.path, CURRENT, "-w", str(seen), *options)
    try:
        yield Pico(board, seen)
    finally:
        board.close()
        memory.close()
    assert board.last_words == ""


def star(scan: Scan, conversions: int) -> list[int]:
    """What it reads of its star: V = I (1 + sink), source I (sum)."""
    source, sink = scan.drives[scan.sample_drive].T
    volts = CURRENT * (1 + sink + (scan.sample_electrode == source) * (1 + source))
    codes = np.floor(volts * LEVELS / REFERENCE).clip(0, LEVELS - 1)
    counts: list[int] = (conversions * codes.astype(int)).tolist()
    return counts


def frames_of(link: Link, count: int) -> list[Frame]:
    """The next ``count`` frames; more may have come."""
    frames: list[Frame] = []
    end = time.monotonic() + PATIENCE
    while len(frames) < count:
        assert time.monotonic() < end
        frames += [item for item in link.poll(0.05) if isinstance(item, Frame)]
    return frames[:count]


def events_of(link: Link, *kinds: str) -> Event:
    """The next event of one of these kinds."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        for item in link.poll(0.05):
            if isinstance(item, Event) and item.kind in kinds:
                return item
    raise AssertionError(f"no event {kinds}")


def check_boot(image: bytes) -> None:
    """Fail unless the boot ROM would run ``image``, by the checksum of its second stage."""
    (held,) = struct.unpack_from("<I", image, 252)
    assert held == boot_checksum(image[:252]), "correct the last word of firmware/pico/boot2.S"


def boot_checksum(stage: bytes) -> int:
    """CRC-32 as the boot ROM has it: 0x04C11DB7, not reflected, from 0xFFFFFFFF."""
    crc = 0xFFFFFFFF
    for byte in stage:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc >> 31 else 0)) & 0xFFFFFFFF
    return crc
