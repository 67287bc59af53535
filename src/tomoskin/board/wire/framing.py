"""Payloads ↔ bytes on the line: COBS(payload ‖ CRC-16/CCITT-FALSE, big-endian) ‖ 0x00."""

from __future__ import annotations

from binascii import crc_hqx
from dataclasses import dataclass

_FULL = 254
"""Longest run of data bytes behind one COBS code byte."""


def crc16(data: bytes | bytearray) -> int:
    """CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF); of ``b"123456789"``: 0x29B1."""
    return crc_hqx(data, 0xFFFF)


def cobs_encode(data: bytes) -> bytes:
    """Bytes without 0x00 that stand for ``data`` (Cheshire and Baker 1999)."""
    out = bytearray()
    for run in data.split(b"\0"):
        start = 0
        while len(run) - start >= _FULL:
            out.append(_FULL + 1)
            out += run[start : start + _FULL]
            start += _FULL
        out.append(len(run) - start + 1)
        out += run[start:]
    if run and len(run) % _FULL == 0:
        out.pop()  # a full run at the very end needs no code byte behind it
    return bytes(out)


def cobs_decode(block: bytes) -> bytes | None:
    """What ``block`` stands for, or None when it holds a 0x00 or its code bytes do not add up.

    Works in place: a code byte becomes the zero that it stands for, so the loop visits code
    bytes only.
    """
    if not block or 0 in block:
        return None
    data = bytearray(block)
    length, place = len(data), 0
    overhead = [0]
    while place < length:
        code = data[place]
        data[place] = 0
        place += code
        if code > _FULL:
            overhead.append(place)
    if place != length:
        return None
    for byte in reversed(overhead):
        del data[byte : byte + 1]
    return bytes(data)


def enclose(payload: bytes) -> bytes:
    """The bytes on the line for one payload."""
    return cobs_encode(payload + crc16(payload).to_bytes(2, "big")) + b"\0"


@dataclass(slots=True)
class Counters:
    """What a stream has held so far.

    Attributes
    ----------
    messages
        Whole messages passed on.
    overlong
        Blocks longer than any message: a line without 0x00, or another device.
    torn
        Blocks whose COBS code bytes do not add up.
    checksum
        Blocks whose CRC is wrong.
    foreign
        Blocks with a right CRC that are no message of this schema in this direction.
    """

    messages: int = 0
    overlong: int = 0
    torn: int = 0
    checksum: int = 0
    foreign: int = 0

    @property
    def corrupt(self) -> int:
        """Blocks that were dropped, for whatever reason."""
        return self.overlong + self.torn + self.checksum + self.foreign


class Deframer:
    """Bytes → payloads with a right checksum. Holds at most one message; never raises."""

    def __init__(self, limit: int) -> None:
        """``limit``: most bytes of payload and checksum together."""
        self._limit = limit + 1 + limit // _FULL  # before the 0x00
        self._partial = b""
        self._skipping = False
        self.counters = Counters()

    def feed(self, data: bytes) -> list[bytes]:
        """Payloads that ``data`` completes, in order."""
        *blocks, rest = data.split(b"\0")
        payloads = []
        if blocks:
            blocks[0] = self._partial + blocks[0]
            self._partial = b""
            for block in blocks:
                payload = self._open(block)
                if payload is not None:
                    payloads.append(payload)
        self._keep(rest)
        return payloads

    def forget(self) -> None:
        """What comes next does not follow what came before: a message under way is given up."""
        self._partial, self._skipping = b"", False

    def drop(self, reason: str) -> None:
        """Count a block that is not passed on; ``reason`` is its counter."""
        setattr(self.counters, reason, getattr(self.counters, reason) + 1)

    def _open(self, block: bytes) -> bytes | None:
        if self._skipping:
            self._skipping = False
            return None
        if not block:
            return None
        if len(block) > self._limit:
            self.drop("overlong")
            return None
        data = cobs_decode(block)
        if data is None:
            self.drop("torn")
            return None
        if crc16(data):
            self.drop("checksum")
            return None
        return data[:-2]

    def _keep(self, rest: bytes) -> None:
        if self._skipping:
            return
        if len(self._partial) + len(rest) > self._limit:
            self.drop("overlong")
            self._partial, self._skipping = b"", True
        else:
            self._partial += rest
