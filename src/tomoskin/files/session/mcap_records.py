"""Records of an MCAP file as bytes and back: the library's, read with suspicion.

A record is an opcode, the length of its body (u64) and the body; numbers are little-endian.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Chunk, Footer, McapRecord, Statistics, SummaryOffset

PREFIX = struct.Struct("<BQ")
"""Opcode and length in front of every body."""

MESSAGE = struct.Struct("<BQHIQQ")
"""A message's record up to its data: prefix, channel, sequence, log and publish time (ns)."""

LARGEST = 64 << 20
"""A longer record is no record of a session."""

LARGEST_SUMMARY = 1 << 30
"""A longer index is none: not even a week in the chunks of 0.1 has one."""

_CHUNK_INDEX = struct.Struct("<BQQQQQI")
_ON_CHANNEL = struct.Struct("<HQ")
_MESSAGE_OPCODE = int(Opcode.MESSAGE)

_CRC_BYTES = 4

Record = TypeVar("Record", bound=McapRecord)


class LoggedMessage(NamedTuple):
    """One message: its channel's number, log time in ns, data, and the offset of its chunk."""

    channel: int
    log_time: int
    data: bytes
    chunk: int


@dataclass(frozen=True)
class Summary:
    """The end of a file: totals of all messages, offsets of attachments, index of the chunks."""

    totals: Statistics
    attachments: tuple[int, ...]
    chunk_index: bytes = field(repr=False)

    def chunks(self, channels: frozenset[int], since: int = 0) -> Iterator[int]:
        """Offsets of the chunks that hold a channel ``wanted`` and end at ``since`` ns or later.

        ValueError where the index does not add up. The library takes ten times as long.
        """
        index, place = self.chunk_index, 0
        while place + _CHUNK_INDEX.size <= len(index):
            body = place + _CHUNK_INDEX.size
            opcode, length, _, last, offset, _, size = _CHUNK_INDEX.unpack_from(index, place)
            place += PREFIX.size + length
            if opcode != Opcode.CHUNK_INDEX or size % _ON_CHANNEL.size or body + size > place:
                break
            if last >= since:
                on_channels = _ON_CHANNEL.iter_unpack(index[body : body + size])
                if any(number in channels for number, _ in on_channels):
                    yield offset
        if place != len(index):
            raise ValueError("the index of the chunks is inconsistent")


def encode(*records: McapRecord) -> bytes:
    """The bytes of records, one after another."""
    builder: Any = RecordBuilder()  # half typed
    for record in records:
        record.write(builder)
    return bytes(builder.end())


def encode_message(channel: int, sequence: int, log_time: int, data: bytes) -> bytes:
    """A message that is published when it is logged; a third of the library's time."""
    size = MESSAGE.size - PREFIX.size + len(data)
    return MESSAGE.pack(_MESSAGE_OPCODE, size, channel, sequence, log_time, log_time) + data


def decode(kind: type[Record], data: bytes) -> Record:
    """The record that ``data`` is.

    Raises
    ------
    ValueError
        Where it is another or does not add up. The library takes short strings, and does not look
        at the CRC of an attachment; so what it has read must give the same bytes again.
    """
    record = _read(kind, data)
    if encode(record) != data:
        raise ValueError(f"the {kind.__name__} is inconsistent")
    return record


def decode_chunk(data: bytes) -> Chunk:
    """The chunk that ``data`` is; ValueError where it is none or its CRC differs."""
    chunk = _read(Chunk, data)
    if data[0] != Opcode.CHUNK:
        raise ValueError("there is no chunk")
    if chunk.compression:
        return chunk
    if len(chunk.data) != chunk.uncompressed_size:
        raise ValueError(
            f"a chunk of {chunk.uncompressed_size} bytes holds {len(chunk.data)} bytes"
        )
    if zlib.crc32(chunk.data) != chunk.uncompressed_crc:
        raise ValueError("the CRC of a chunk is wrong")
    return chunk


def decode_summary(footer: Footer, data: bytes) -> Summary | None:
    """The summary between the data of a file and its ``footer``; None where it has no totals.

    Raises ValueError where it does not add up or its CRC differs.
    """
    start = footer.summary_start
    if footer.summary_crc not in (0, zlib.crc32(encode(footer)[:-_CRC_BYTES], zlib.crc32(data))):
        raise ValueError("the CRC of the index is wrong")
    groups = {}
    for group in _decode_all(SummaryOffset, data[footer.summary_offset_start - start :]):
        begin = group.group_start - start
        groups[group.group_opcode] = data[begin : begin + group.group_length]
    totals = next(_decode_all(Statistics, groups.get(Opcode.STATISTICS, b"")), None)
    attached = _decode_all(AttachmentIndex, groups.get(Opcode.ATTACHMENT_INDEX, b""))
    offsets = tuple(index.offset for index in attached)
    index = groups.get(Opcode.CHUNK_INDEX, b"")
    return None if totals is None else Summary(totals, offsets, index)


def messages_in(chunk: Chunk, offset: int, first: int = 0) -> Iterator[LoggedMessage]:
    """Messages of a chunk whose record is at ``offset``; channels count from ``first``.

    Raises ValueError where its records do not add up although the CRC is right: another program
    has written them wrongly.
    """
    data, place, end = chunk.data, 0, len(chunk.data)
    while place + PREFIX.size <= end:
        opcode, length = PREFIX.unpack_from(data, place)
        after = place + PREFIX.size + length
        if after > end:
            break
        if opcode == _MESSAGE_OPCODE:
            begin = place + MESSAGE.size
            if begin > after:
                break
            _, _, channel, _, log_time, _ = MESSAGE.unpack_from(data, place)
            yield LoggedMessage(channel - first, log_time, data[begin:after], offset)
        place = after
    if place != end:
        raise ValueError("the records of a chunk are inconsistent")


def _decode_all(kind: type[Record], data: bytes) -> Iterator[Record]:
    """Records of one kind, one after another."""
    place = 0
    while place < len(data):
        length = PREFIX.unpack(data[place : place + PREFIX.size].ljust(PREFIX.size, b"\0"))[1]
        after = place + PREFIX.size + int(length)
        yield decode(kind, data[place:after])
        place = after


def _read(kind: type[Record], data: bytes) -> Record:
    reader: Any = kind
    try:
        record: Record = reader.read(ReadDataStream(io.BytesIO(data[PREFIX.size :])))
    except (McapError, struct.error, OverflowError) as error:
        raise ValueError(f"the {kind.__name__} is cut off") from error
    return record
