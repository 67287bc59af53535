"""What stands in an MCAP file, parsed from the bodies of its records."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field

from tomoskin.core import DataError
from tomoskin.recording import mcap

MEND = "tomoskin session repair recovers what is whole"
"""What to do about a damaged file."""


@dataclass(frozen=True, slots=True)
class Message:
    """One message: its channel's number, log time in ns, data, and the chunk that it was in."""

    channel: int
    log_time: int
    data: bytes
    chunk: int


@dataclass(frozen=True)
class Attachment:
    """A file inside the file."""

    name: str
    media_type: str
    data: bytes


@dataclass(frozen=True)
class Totals:
    """Messages by channel, and first and last log time in ns."""

    counts: dict[int, int]
    first: int
    last: int


@dataclass
class Chunk:
    """Where a chunk's record is, and what its head says."""

    offset: int
    length: int
    first: int
    last: int
    crc: int
    compression: str
    records: bytes = field(repr=False)


class Fields:
    """Takes fields off the body of a record; ValueError when it is short or no text."""

    def __init__(self, body: bytes) -> None:
        self._body = body
        self.place = 0

    def numbers(self, layout: str) -> tuple[int, ...]:
        """Numbers in a layout of :mod:`struct`."""
        data = self.bytes(struct.calcsize("<" + layout))
        found: tuple[int, ...] = struct.unpack("<" + layout, data)
        return found

    def bytes(self, length: int) -> bytes:
        """So many bytes."""
        if length > len(self._body) - self.place:
            raise ValueError(f"{length} bytes are said to follow, {len(self._body)} in all")
        self.place += length
        return self._body[self.place - length : self.place]

    def text(self) -> str:
        """A string behind its length."""
        return self.bytes(self.numbers("I")[0]).decode()

    def mapping(self) -> dict[str, str]:
        """A map of strings."""
        length = self.numbers("I")[0]
        end = self.place + length
        found = {}
        while self.place < end:
            key = self.text()
            found[key] = self.text()
        return found


def parse_chunk(body: bytes, offset: int) -> Chunk:
    """A chunk whose record is at ``offset``; ValueError when it does not add up."""
    fields = Fields(body)
    first, last = fields.numbers("QQ")
    size, crc = fields.numbers("QI")
    compression = fields.text()
    data = fields.bytes(fields.numbers("Q")[0])
    if not compression and len(data) != size:
        raise ValueError(f"a chunk of {size} bytes holds {len(data)}")
    length = mcap.PREFIX.size + len(body)
    return Chunk(offset, length, first, last, crc, compression, data)


def parse_attachment(body: bytes) -> Attachment:
    """A file inside; ValueError when it does not add up or its CRC differs."""
    fields = Fields(body)
    fields.numbers("QQ")
    name, media_type = fields.text(), fields.text()
    data = fields.bytes(fields.numbers("Q")[0])
    end = fields.place
    if zlib.crc32(body[:end]) != fields.numbers("I")[0]:
        raise ValueError(f"the CRC of the file {name} inside differs")
    return Attachment(name, media_type, data)


def parse_metadata(body: bytes) -> tuple[str, dict[str, str]]:
    """Named strings; ValueError when they do not add up."""
    fields = Fields(body)
    name = fields.text()
    return name, fields.mapping()


def messages_in(chunk: Chunk, where: str) -> Iterator[Message]:
    """Messages of a chunk whose CRC was right.

    Raises
    ------
    DataError
        When its records do not add up all the same: written wrongly, by another program.
    """
    records, place, end = chunk.records, 0, len(chunk.records)
    prefix, head = mcap.PREFIX, mcap.MESSAGE_HEAD
    while place < end:
        if end - place < prefix.size:
            break
        opcode, length = prefix.unpack_from(records, place)
        place += prefix.size
        if length > end - place:
            break
        if opcode == mcap.MESSAGE:
            if length < head.size:
                break
            channel, _, log_time, _ = head.unpack_from(records, place)
            data = records[place + head.size : place + length]
            yield Message(channel, log_time, data, chunk.offset)
        place += length
    if place != end:
        raise DataError(
            "the records of a chunk do not add up",
            where=f"{where}, byte {chunk.offset}",
            hint=MEND,
        )
