"""The records of an MCAP file as bytes (the format's specification, version 0).

A record is an opcode, the length of its body (u64) and the body; numbers are little-endian, a
string or map stands behind its length (u32).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass

from tomoskin.core import MAGIC

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX = range(9, 14)
SUMMARY_OFFSET, DATA_END = 14, 15

PREFIX = struct.Struct("<BQ")
"""Opcode and length in front of every body."""

MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time and publish time (ns) in front of a message's data."""

CHUNK_HEAD = struct.Struct("<QQQI")
"""First and last log time, size and CRC-32 of the records in a chunk."""

FOOTER_BODY = struct.Struct("<QQI")
"""Where the summary and its offsets begin, and the CRC-32 of both."""

FOOTER_SIZE = PREFIX.size + FOOTER_BODY.size + len(MAGIC)
"""Bytes at the end of a whole file: footer and magic."""

_MESSAGE = struct.Struct("<BQHIQQ")
_ENTRY = struct.Struct("<QQ")
_COUNT = struct.Struct("<HQ")
_INDEX_HEAD = struct.Struct("<QQQQI")


@dataclass(frozen=True)
class Schema:
    """How the messages of a channel are to be read: ``text`` in a language named ``encoding``."""

    id: int
    name: str
    encoding: str
    text: str


@dataclass(frozen=True)
class Channel:
    """A stream of messages under a ``topic``."""

    id: int
    schema: int
    topic: str
    encoding: str


def record(opcode: int, body: bytes) -> bytes:
    """One whole record."""
    return PREFIX.pack(opcode, len(body)) + body


def text(value: str) -> bytes:
    """A string behind its length."""
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def mapping(values: Mapping[str, str]) -> bytes:
    """A map of strings behind its length."""
    body = b"".join(text(key) + text(value) for key, value in values.items())
    return struct.pack("<I", len(body)) + body


def header(library: str) -> bytes:
    """First record of a file; no profile."""
    return record(HEADER, text("") + text(library))


def schema(item: Schema) -> bytes:
    """Record of a schema."""
    data = item.text.encode()
    head = struct.pack("<H", item.id) + text(item.name) + text(item.encoding)
    return record(SCHEMA, head + struct.pack("<I", len(data)) + data)


def channel(item: Channel) -> bytes:
    """Record of a channel."""
    head = struct.pack("<HH", item.id, item.schema)
    return record(CHANNEL, head + text(item.topic) + text(item.encoding) + mapping({}))


def message(channel_id: int, sequence: int, log_time: int, data: bytes) -> bytes:
    """Record of a message, published when it was logged."""
    size = MESSAGE_HEAD.size + len(data)
    return _MESSAGE.pack(MESSAGE, size, channel_id, sequence, log_time, log_time) + data


def chunk(first: int, last: int, records: bytes) -> bytes:
    """Record of a chunk, not compressed, with the CRC-32 of its records."""
    head = CHUNK_HEAD.pack(first, last, len(records), zlib.crc32(records))
    return record(CHUNK, head + text("") + struct.pack("<Q", len(records)) + records)


def message_index(channel_id: int, entries: list[tuple[int, int]]) -> bytes:
    """Record that says where in a chunk the messages of a channel begin: (log time, place)."""
    body = b"".join(_ENTRY.pack(*entry) for entry in entries)
    return record(MESSAGE_INDEX, struct.pack("<HI", channel_id, len(body)) + body)


def chunk_index(
    times: tuple[int, int],
    place: tuple[int, int],
    indexes: Mapping[int, int],
    size: tuple[int, int],
) -> bytes:
    """Record that says where a chunk is.

    ``times`` first and last log time; ``place`` offset and length of the chunk's record;
    ``indexes`` offset of each channel's message index; ``size`` bytes of the message indexes, and
    of the chunk's records.
    """
    offsets = b"".join(_COUNT.pack(*item) for item in indexes.items())
    body = _INDEX_HEAD.pack(*times, *place, len(offsets)) + offsets
    return record(CHUNK_INDEX, body + struct.pack("<QIQQ", size[0], 0, size[1], size[1]))


def parse_chunk_indexes(data: bytes) -> tuple[int, list[tuple[int, tuple[int, ...]]]]:
    """Whole records of chunk indexes at the start of ``data``: their bytes; offset and channels.

    Raises ValueError when a record is of another kind, or its channels are longer than it.
    """
    place, found = 0, []
    head = PREFIX.size + _INDEX_HEAD.size
    while place + head <= len(data):
        opcode, length = PREFIX.unpack_from(data, place)
        _, _, offset, _, size = _INDEX_HEAD.unpack_from(data, place + PREFIX.size)
        if opcode != CHUNK_INDEX or _INDEX_HEAD.size + size > length or size % _COUNT.size:
            raise ValueError("a record among the indexes of the chunks does not add up")
        if place + PREFIX.size + length > len(data):
            break
        pairs = _COUNT.iter_unpack(data[place + head : place + head + size])
        found.append((offset, tuple(channel for channel, _ in pairs)))
        place += PREFIX.size + length
    return place, found


def attachment(log_time: int, name: str, media_type: str, data: bytes) -> bytes:
    """Record of a file inside the file."""
    head = struct.pack("<QQ", log_time, 0) + text(name) + text(media_type)
    body = head + struct.pack("<Q", len(data)) + data
    return record(ATTACHMENT, body + struct.pack("<I", zlib.crc32(body)))


def attachment_index(
    place: tuple[int, int], log_time: int, size: int, name: str, media_type: str
) -> bytes:
    """Record that says where an attachment is: ``place`` offset and length of its record."""
    body = struct.pack("<QQQQQ", *place, log_time, 0, size) + text(name) + text(media_type)
    return record(ATTACHMENT_INDEX, body)


def metadata(name: str, values: Mapping[str, str]) -> bytes:
    """Record of named strings."""
    return record(METADATA, text(name) + mapping(values))


def metadata_index(place: tuple[int, int], name: str) -> bytes:
    """Record that says where named strings are: ``place`` offset and length of their record."""
    return record(METADATA_INDEX, struct.pack("<QQ", *place) + text(name))


def statistics(
    counts: Mapping[int, int], others: tuple[int, int, int, int, int], times: tuple[int, int]
) -> bytes:
    """Record of totals.

    ``counts`` messages of each channel; ``others`` number of schemas, channels, attachments, named
    strings and chunks; ``times`` first and last log time.
    """
    by_channel = b"".join(_COUNT.pack(*item) for item in counts.items())
    body = struct.pack("<QHIIII", sum(counts.values()), *others) + struct.pack("<QQ", *times)
    return record(STATISTICS, body + struct.pack("<I", len(by_channel)) + by_channel)


def summary_offset(opcode: int, start: int, length: int) -> bytes:
    """Record that says where in the summary the records of one kind are."""
    return record(SUMMARY_OFFSET, struct.pack("<BQQ", opcode, start, length))


def data_end(crc: int) -> bytes:
    """Last record before the summary: CRC-32 of everything before it."""
    return record(DATA_END, struct.pack("<I", crc))


def ending(summary_start: int, offsets_start: int, crc: int) -> bytes:
    """Footer and magic; ``crc`` is that of the summary, continued here over the footer itself."""
    head = PREFIX.pack(FOOTER, FOOTER_BODY.size) + struct.pack("<QQ", summary_start, offsets_start)
    return head + struct.pack("<I", zlib.crc32(head, crc)) + MAGIC
