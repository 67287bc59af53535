"""An MCAP file in the making: small chunks, each written whole, and an index at the end."""

from __future__ import annotations

import contextlib
import os
import struct
import tempfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from typing import IO, BinaryIO

from tomoskin.core import MAGIC
from tomoskin.recording import mcap

CHUNK_BYTES = 8192
"""A chunk is written as soon as it is so long: what a killed program can lose."""

SEEK_TABLE = "tomoskin.seek"
"""Name of the attachment that finds a time without reading the whole index."""

SEEK_ROW = struct.Struct("<QQ")
"""A row of it: first log time of a chunk (ns) and the chunk's offset."""

_SEEK_STEP = 1_000_000_000
_SPILL = 1 << 20
_COPY = 1 << 20


class ContainerWriter:
    """Writes one MCAP file without compression, in memory that does not grow.

    The index of the chunks waits in a temporary file. Every chunk goes out in one write; when a
    write fails, the file is cut back to its last whole record, the :class:`OSError` is raised,
    and nothing more is written.

    Parameters
    ----------
    file
        Opened for binary writing without a buffer, at its beginning; closed by :meth:`close`.
    library
        What the file says it was written by.
    schemas, channels
        All that the file will hold.
    """

    def __init__(
        self,
        file: BinaryIO,
        library: str,
        schemas: Sequence[mcap.Schema],
        channels: Sequence[mcap.Channel],
    ) -> None:
        self._file = file
        self._size = 0
        self._crc = 0
        self._broken = False
        self._schemas = b"".join(map(mcap.schema, schemas))
        self._channels = b"".join(map(mcap.channel, channels))
        self._kinds = (len(schemas), len(channels))
        self._counts = {channel.id: 0 for channel in channels}
        self._times: tuple[int, int] | None = None
        self._chunks = 0
        self._chunk_index: IO[bytes] = tempfile.SpooledTemporaryFile(_SPILL)  # noqa: SIM115
        self._attachments: list[bytes] = []
        self._metadata: list[bytes] = []
        self._seek = bytearray()
        self._next_seek = 0
        self._records = bytearray(self._schemas + self._channels)
        self._indexes: dict[int, list[tuple[int, int]]] = {}
        self._span: tuple[int, int] | None = None
        self._write(MAGIC + mcap.header(library))

    @property
    def size(self) -> int:
        """Bytes in the file so far, each of them part of a whole record."""
        return self._size

    @property
    def is_linked(self) -> bool:
        """Whether the file is still in a folder; False also when its disk does not answer."""
        try:
            return not self._file.closed and os.fstat(self._file.fileno()).st_nlink > 0
        except OSError:
            return False

    def attach(self, name: str, media_type: str, data: bytes, log_time: int = 0) -> None:
        """Put a whole file inside."""
        self.flush()
        record = mcap.attachment(log_time, name, media_type, data)
        place = (self._size, len(record))
        self._write(record)
        index = mcap.attachment_index(place, log_time, len(data), name, media_type)
        self._attachments.append(index)

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Put named strings inside."""
        self.flush()
        record = mcap.metadata(name, values)
        place = (self._size, len(record))
        self._write(record)
        self._metadata.append(mcap.metadata_index(place, name))

    def message(self, channel: int, log_time: int, data: bytes) -> None:
        """Add one message; the chunk is written when it is long enough."""
        if self._broken:
            raise OSError("it could not be written before")
        records = self._records
        self._indexes.setdefault(channel, []).append((log_time, len(records)))
        count = self._counts[channel]
        records += mcap.message(channel, count % 2**32, log_time, data)
        self._counts[channel] = count + 1
        first, last = self._span or (log_time, log_time)
        self._span = (min(first, log_time), max(last, log_time))
        if len(records) >= CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Write the open chunk."""
        if self._span is None or self._broken:
            return
        span, place = self._span, self._size
        chunk = mcap.chunk(*span, bytes(self._records))
        size, offsets, indexes = len(self._records), {}, bytearray()
        for channel, entries in self._indexes.items():
            offsets[channel] = place + len(chunk) + len(indexes)
            indexes += mcap.message_index(channel, entries)
        self._write(chunk + indexes)
        self._remember(mcap.chunk_index(span, (place, len(chunk)), offsets, (len(indexes), size)))
        self._chunks += 1
        self._note_times(span, place)
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
                self.attach(SEEK_TABLE, "application/octet-stream", bytes(self._seek))
                self._finish()
        finally:
            self._chunk_index.close()
            self._file.close()

    def _remember(self, index: bytes) -> None:
        try:
            self._chunk_index.write(index)
        except OSError:
            self._broken = True
            raise

    def _note_times(self, span: tuple[int, int], place: int) -> None:
        first, last = self._times or span
        self._times = (min(first, span[0]), max(last, span[1]))
        if span[0] >= self._next_seek:
            self._seek += SEEK_ROW.pack(span[0], place)
            self._next_seek = span[0] + _SEEK_STEP

    def _write(self, data: bytes | bytearray) -> None:
        """All of ``data`` or nothing."""
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError:
            self._broken = True
            with contextlib.suppress(OSError):
                self._file.truncate(self._size)
            raise
        self._size += len(data)
        self._crc = zlib.crc32(data, self._crc)

    def _finish(self) -> None:
        whole = self._size
        try:
            self._write(mcap.data_end(self._crc))
            self._summary()
            os.fsync(self._file.fileno())
        except OSError:
            with contextlib.suppress(OSError):
                self._file.truncate(whole)
            raise

    def _summary(self) -> None:
        start, self._crc = self._size, 0
        offsets = []
        others = (*self._kinds, len(self._attachments), len(self._metadata), self._chunks)
        groups: tuple[tuple[int, Iterable[bytes]], ...] = (
            (mcap.SCHEMA, (self._schemas,)),
            (mcap.CHANNEL, (self._channels,)),
            (mcap.STATISTICS, (mcap.statistics(self._counts, others, self._times or (0, 0)),)),
            (mcap.ATTACHMENT_INDEX, self._attachments),
            (mcap.METADATA_INDEX, self._metadata),
            (mcap.CHUNK_INDEX, self._chunk_indexes()),
        )
        for opcode, parts in groups:
            before = self._size
            for part in parts:
                self._write(part)
            if self._size > before:
                offsets.append(mcap.summary_offset(opcode, before, self._size - before))
        offsets_start = self._size
        self._write(b"".join(offsets))
        self._write(mcap.ending(start, offsets_start, self._crc))

    def _chunk_indexes(self) -> Iterable[bytes]:
        self._chunk_index.seek(0)
        while part := self._chunk_index.read(_COPY):
            yield part
