"""A stream of bytes, torn and dirty as it comes, → whole messages; the rest is counted."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.board.wire.codec import decode_payload, is_command
from tomoskin.board.wire.framing import Deframer
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
