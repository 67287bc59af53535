"""An MCAP file in the making: chunks that are each written whole, and an index at the end.

The records are those of the ``mcap`` library. Its Writer is not used: it takes almost three times
as long for a message, and a file that it could not write on does not end with a whole record.
"""

from __future__ import annotations

import contextlib
import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import BinaryIO

from mcap import records as mcap
from mcap.opcode import Opcode

from tomoskin.core import MAGIC
from tomoskin.files.session.mcap_records import encode, encode_message

CHUNK_BYTES = 1 << 18
"""A chunk is written once it is so long; :meth:`ContainerWriter.flush` writes it earlier."""


class ContainerWriter:
    """Writes one MCAP file without compression.

    When a write fails, the file is cut back to its last whole record, the :class:`OSError` is
    raised, and nothing more is written.

    Parameters
    ----------
    file
        Opened for binary writing without a buffer, at its beginning; closed by :meth:`close`.
    library
        What the file says it was written by.
    schemas, channels
        All that the file will hold; they stand in its first chunk.

    Attributes
    ----------
    size
        Bytes in the file so far, each of them part of a whole record.
    """

    def __init__(
        self,
        file: BinaryIO,
        library: str,
        schemas: Sequence[mcap.Schema],
        channels: Sequence[mcap.Channel],
    ) -> None:
        self.size = 0
        self._file, self._crc, self._broken = file, 0, False
        counts = {channel.id: 0 for channel in channels}
        self._totals = mcap.Statistics(0, len(channels), counts, 0, 0, 0, 0, 0, len(schemas))
        self._summary = {
            Opcode.SCHEMA: bytearray(encode(*schemas)),
            Opcode.CHANNEL: bytearray(encode(*channels)),
            Opcode.STATISTICS: bytearray(),
            Opcode.ATTACHMENT_INDEX: bytearray(),
            Opcode.METADATA_INDEX: bytearray(),
            Opcode.CHUNK_INDEX: bytearray(),
        }
        self._records = self._summary[Opcode.SCHEMA] + self._summary[Opcode.CHANNEL]
        self._indexes: dict[int, mcap.MessageIndex] = {}
        self._span: tuple[int, int] | None = None
        self._write(MAGIC + encode(mcap.Header("", library)))

    @property
    def is_linked(self) -> bool:
        """Whether the file is still in a folder; False also when its disk does not answer."""
        try:
            return not self._file.closed and os.fstat(self._file.fileno()).st_nlink > 0
        except OSError:
            return False

    def attach(self, name: str, media_type: str, data: bytes, log_time: int = 0) -> None:
        """Add a whole file under a name."""
        self.flush()
        record = encode(mcap.Attachment(0, log_time, name, media_type, data))
        index = mcap.AttachmentIndex(
            self._write(record), len(record), log_time, 0, len(data), name, media_type
        )
        self._summary[Opcode.ATTACHMENT_INDEX] += encode(index)
        self._totals.attachment_count += 1

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Add named strings under a title."""
        self.flush()
        record = encode(mcap.Metadata(name, dict(values)))
        index = mcap.MetadataIndex(self._write(record), len(record), name)
        self._summary[Opcode.METADATA_INDEX] += encode(index)
        self._totals.metadata_count += 1

    def message(self, channel: int, log_time: int, data: bytes) -> None:
        """Add one message; the chunk is written when it is long enough."""
        if self._broken:
            raise OSError("an earlier write failed")
        records = self._records
        index = self._indexes.get(channel)
        if index is None:
            index = self._indexes[channel] = mcap.MessageIndex(channel, [])
        index.records.append((log_time, len(records)))
        number = self._totals.channel_message_counts[channel]
        records += encode_message(channel, number % 2**32, log_time, data)
        self._totals.channel_message_counts[channel] = number + 1
        first, last = self._span or (log_time, log_time)
        self._span = (min(first, log_time), max(last, log_time))
        if len(records) >= CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Write the open chunk, however short it is."""
        if self._span is None or self._broken:
            return
        records, (first, last), totals = bytes(self._records), self._span, self._totals
        chunk = encode(mcap.Chunk("", records, last, first, zlib.crc32(records), len(records)))
        begin, place = self.size, self.size + len(chunk)
        indexes, places = bytearray(), {}
        for channel, index in self._indexes.items():
            places[channel] = place + len(indexes)
            indexes += encode(index)
        self._write(chunk + indexes)
        entry = mcap.ChunkIndex(
            len(chunk), begin, "", len(records), last, len(indexes), places, first, len(records)
        )
        self._summary[Opcode.CHUNK_INDEX] += encode(entry)
        earliest = totals.message_start_time if totals.chunk_count else first
        totals.message_start_time = min(earliest, first)
        totals.message_end_time = max(totals.message_end_time, last)
        totals.chunk_count += 1
        self._records, self._indexes, self._span = bytearray(), {}, None

    def close(self) -> None:
        """Write the open chunk and the summary, and close the file; a second call does nothing.

        Raises
        ------
        OSError
            When the end cannot be written; everything before it is in the file.
        """
        if self._file.closed:
            return
        try:
            if not self._broken:
                self.flush()
                self._finish()
        finally:
            self._file.close()

    def _finish(self) -> None:
        last_chunk = self.size
        try:
            self._write(encode(mcap.DataEnd(self._crc)))
            self._write(self._ending(self.size))
            os.fsync(self._file.fileno())
        except OSError:
            with contextlib.suppress(OSError):
                self._file.truncate(last_chunk)
            raise

    def _ending(self, start: int) -> bytes:
        """The summary, its offsets, the footer and the magic, as they stand from ``start`` on."""
        totals = self._totals
        totals.message_count = sum(totals.channel_message_counts.values())
        self._summary[Opcode.STATISTICS] = bytearray(encode(totals))
        summary, offsets = bytearray(), []
        for opcode, group in self._summary.items():
            if group:
                offsets.append(mcap.SummaryOffset(opcode, start + len(summary), len(group)))
                summary += group
        offsets_start = start + len(summary)
        summary += encode(*offsets)
        head = encode(mcap.Footer(start, offsets_start, 0))[:-4]
        return bytes(summary) + head + struct.pack("<I", zlib.crc32(summary + head)) + MAGIC

    def _write(self, data: bytes | bytearray) -> int:
        """Write all of ``data`` or nothing; where it begins."""
        if self._broken:
            raise OSError("an earlier write failed")
        place = self.size
        if os.fstat(self._file.fileno()).st_size != place:
            self._broken = True  # what it holds is no longer what was written: nothing is cut off
            raise OSError("another program has changed the file")
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            self._broken = True
            with contextlib.suppress(OSError):
                self._file.truncate(place)
            raise
        self.size += len(data)
        self._crc = zlib.crc32(data, self._crc)
        return place
