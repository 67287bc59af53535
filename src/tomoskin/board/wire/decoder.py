"""A stream of bytes, torn and dirty as it comes, → whole messages; the rest is counted."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from tomoskin.board.wire.codec import decode_payload, is_command
from tomoskin.board.wire.framing import cobs_decode, crc16, enclosed_size
from tomoskin.board.wire.messages import Message
from tomoskin.board.wire.schema import SCHEMA


@dataclass(frozen=True, slots=True)
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
    bytes_dropped
        Bytes in the blocks that were not passed on.
    """

    messages: int = 0
    overlong: int = 0
    torn: int = 0
    checksum: int = 0
    foreign: int = 0
    bytes_dropped: int = 0

    @property
    def corrupt(self) -> int:
        """Blocks that were dropped, for whatever reason."""
        return self.overlong + self.torn + self.checksum + self.foreign


class Deframer:
    """Bytes → payloads with a right checksum. Holds at most one message; never raises."""

    def __init__(self, limit: int) -> None:
        """``limit``: most bytes of payload and checksum together."""
        self._limit = enclosed_size(limit)
        self._partial = b""
        self._skipping = False
        self.counts: Counter[str] = Counter()

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

    def drop(self, reason: str, size: int) -> None:
        """Count a block of ``size`` bytes that is not passed on."""
        self.counts[reason] += 1
        self.counts["bytes_dropped"] += size

    def _open(self, block: bytes) -> bytes | None:
        if self._skipping:
            self._skipping = False
            self.counts["bytes_dropped"] += len(block)
            return None
        if not block:
            return None
        if len(block) > self._limit:
            self.drop("overlong", len(block))
            return None
        data = cobs_decode(block)
        if data is None:
            self.drop("torn", len(block))
            return None
        if crc16(data):
            self.drop("checksum", len(block))
            return None
        return data[:-2]

    def _keep(self, rest: bytes) -> None:
        if self._skipping:
            self.counts["bytes_dropped"] += len(rest)
        elif len(self._partial) + len(rest) > self._limit:
            self.drop("overlong", len(self._partial) + len(rest))
            self._partial, self._skipping = b"", True
        else:
            self._partial += rest


class Decoder:
    """Bytes from a device → its messages.

    Whatever is torn, corrupt, foreign or endless is dropped up to the next 0x00 and counted;
    memory is bounded by one message, and no input raises.
    """

    def __init__(self) -> None:
        """A decoder at the start of a stream."""
        self._deframer = Deframer(SCHEMA.from_device_bytes)
        self._messages = 0

    def feed(self, data: bytes, host_time: float) -> list[Message]:
        """Messages that ``data`` completes; frames carry ``host_time`` (monotonic s)."""
        messages = []
        for payload in self._deframer.feed(data):
            message = decode_payload(payload, host_time)
            if message is None or is_command(message):
                self._deframer.drop("foreign", len(payload) + 2)
            else:
                messages.append(message)
        self._messages += len(messages)
        return messages

    def forget(self) -> None:
        """The stream goes on elsewhere: a message under way is given up, the counts stay."""
        self._deframer.forget()

    @property
    def counters(self) -> Counters:
        """What the stream has held so far."""
        return Counters(messages=self._messages, **self._deframer.counts)
