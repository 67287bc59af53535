"""An MCAP file read with suspicion: every length is checked, every chunk's CRC is compared."""

from __future__ import annotations

import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Self

from tomoskin.core import MAGIC, DataError
from tomoskin.recording import mcap
from tomoskin.recording.container import SEEK_ROW, SEEK_TABLE
from tomoskin.recording.parts import (
    MEND,
    Attachment,
    Chunk,
    Fields,
    Message,
    Totals,
    messages_in,
    parse_attachment,
    parse_chunk,
    parse_metadata,
)

_BLOCK = 1 << 20

LARGEST = 64 << 20
"""A longer record is no record of a session."""


class ContainerReader:
    """Reads one MCAP file; a context manager.

    A file without its end, as a killed program leaves it, is read up to where it is torn, and
    :attr:`torn` says where. Damage inside is an error that names the byte.

    Attributes
    ----------
    torn
        A sentence on what is missing at the end, or "".

    Raises
    ------
    DataError
        When the file cannot be read, is no MCAP file, or is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.where = str(path)
        self.torn = ""
        try:
            self._file: BinaryIO = path.open("rb", buffering=1 << 18)
            self.size = self._file.seek(0, io.SEEK_END)
        except OSError as error:
            reason = "there is no such file" if isinstance(error, FileNotFoundError) else (
                f"cannot be read: {error.strerror or error}")  # fmt: skip
            raise DataError(reason, where=self.where) from error
        try:
            self._start()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Self:
        """The reader itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    @property
    def whole(self) -> bool:
        """Whether the file was ended properly."""
        return self._summary_start > 0

    def describes(self) -> dict[str, dict[str, str]]:
        """The named strings that stand before the first chunk."""
        found = {}
        for opcode, offset, body in self._front():
            if opcode == mcap.METADATA:
                with self._understood(offset):
                    name, values = parse_metadata(body)
                found[name] = values
        return found

    def attachments(self) -> Iterator[Attachment]:
        """Every file inside: by the index, or by going through the whole file."""
        for offset in self._attachment_offsets():
            yield self._attachment(offset)

    def totals(self) -> Totals | None:
        """Totals of a whole file; None where there is no summary."""
        start, length = self._groups.get(mcap.STATISTICS, (0, 0))
        if not length:
            return None
        fields = Fields(self._body(start))
        with self._understood(start):
            fields.numbers("QHIIII")
            first, last = fields.numbers("QQ")
            n = fields.numbers("I")[0] // 10
            pairs = [fields.numbers("HQ") for _ in range(n)]
        return Totals({pair[0]: pair[1] for pair in pairs}, first, last)

    def chunks(self, since: int = 0) -> Iterator[Chunk]:
        """Chunks from the first that may hold log times of ``since`` ns or later; CRC checked."""
        for opcode, offset, _ in self._records(self._offset_of(since)):
            if opcode == mcap.CHUNK:
                yield self._chunk(offset)

    def messages(self, wanted: frozenset[int], since: int = 0) -> Iterator[Message]:
        """Messages of the channels ``wanted`` logged at ``since`` ns or later, in file order."""
        for chunk in self.chunks(since):
            if chunk.last >= since:
                for message in messages_in(chunk, self.where):
                    if message.channel in wanted and message.log_time >= since:
                        yield message

    def rare(self, channel: int) -> Iterator[Message]:
        """Messages of a channel, in file order; of a whole file only the chunks that hold some."""
        if not self.whole:
            yield from self.messages(frozenset({channel}))
            return
        for offset, held in self._chunk_index():
            if channel in held:
                for message in messages_in(self._chunk(offset), self.where):
                    if message.channel == channel:
                        yield message

    def _chunk_index(self) -> Iterator[tuple[int, tuple[int, ...]]]:
        """(offset, channels) of every chunk; the index is read a block at a time."""
        place, length = self._groups.get(mcap.CHUNK_INDEX, (0, 0))
        end, rest = place + length, b""
        while place < end:
            block = self._read(place, min(_BLOCK, end - place))
            if not block:
                raise self._damaged(place, "the index of the chunks is cut")
            place += len(block)
            begun = place - len(rest) - len(block)
            with self._understood(begun):
                used, found = mcap.parse_chunk_indexes(rest + block)
            yield from found
            rest = (rest + block)[used:]
        if rest:
            raise self._damaged(end, "the index of the chunks is cut")

    def _start(self) -> None:
        if self._read(0, len(MAGIC)) != MAGIC:
            raise DataError(
                "is not an MCAP file",
                where=self.where,
                hint="recordings of other programs: tomoskin session import",
            )
        self._groups: dict[int, tuple[int, int]] = {}
        self._summary_start = 0
        self._end = self.size
        tail = self._read(self.size - mcap.FOOTER_SIZE, mcap.FOOTER_SIZE)
        head = mcap.PREFIX.pack(mcap.FOOTER, mcap.FOOTER_BODY.size)
        if not (tail.startswith(head) and tail.endswith(MAGIC)):
            self.torn = "was not ended: the program or the computer stopped while it was written"
            return
        start, offsets, crc = mcap.FOOTER_BODY.unpack_from(tail, len(head))
        self._end = self.size - mcap.FOOTER_SIZE
        if start:
            self._open_summary(start, offsets, crc)

    def _open_summary(self, start: int, offsets: int, crc: int) -> None:
        where = f"{self.where}, byte {start}"
        if not len(MAGIC) <= start <= offsets <= self._end:
            raise DataError("the index is not in the file", where=where, hint=MEND)
        length = self.size - mcap.FOOTER_SIZE + mcap.PREFIX.size + 16 - start
        if crc and crc != self._crc(start, length):
            raise DataError("the index is damaged (its CRC differs)", where=where, hint=MEND)
        for opcode, offset, _ in self._records(offsets):
            if opcode == mcap.SUMMARY_OFFSET:
                with self._understood(offset):
                    group, *place = Fields(self._body(offset)).numbers("BQQ")
                    self._groups[group] = (place[0], place[1])
        self._summary_start = start

    def _crc(self, start: int, length: int) -> int:
        crc, place = 0, start
        while place < start + length:
            part = self._read(place, min(1 << 20, start + length - place))
            crc, place = zlib.crc32(part, crc), place + len(part)
        return crc

    def _front(self) -> Iterator[tuple[int, int, bytes]]:
        """(opcode, offset, body) of the records before the first chunk."""
        for opcode, offset, _ in self._records(len(MAGIC)):
            if opcode == mcap.CHUNK:
                return
            yield opcode, offset, self._body(offset)

    def _attachment_offsets(self) -> Iterator[int]:
        start, length = self._groups.get(mcap.ATTACHMENT_INDEX, (0, 0))
        if self.whole:
            for opcode, offset, _ in self._records(start, start + length):
                if opcode == mcap.ATTACHMENT_INDEX:
                    with self._understood(offset):
                        yield Fields(self._body(offset)).numbers("Q")[0]
            return
        for opcode, offset, _ in self._records(len(MAGIC)):
            if opcode == mcap.ATTACHMENT:
                yield offset

    def _attachment(self, offset: int) -> Attachment:
        with self._understood(offset):
            return parse_attachment(self._body(offset))

    def _offset_of(self, since: int) -> int:
        """Where to begin so as to meet everything from ``since`` on."""
        best = len(MAGIC)
        if since <= 0 or not self.whole:
            return best
        for found in self.attachments():
            if found.name == SEEK_TABLE and len(found.data) % SEEK_ROW.size == 0:
                for first, offset in SEEK_ROW.iter_unpack(found.data):
                    if first >= since:
                        break
                    best = offset
        return best

    def _records(self, start: int, end: int | None = None) -> Iterator[tuple[int, int, int]]:
        """(opcode, offset, length of the body) one after another; ends where the file is torn."""
        place, end = start, self._end if end is None else end
        while place < end:
            head = self._read(place, mcap.PREFIX.size)
            if len(head) < mcap.PREFIX.size:
                self._stop(place, "a record's head is cut")
                return
            opcode, length = mcap.PREFIX.unpack(head)
            if length > LARGEST or not opcode:
                raise self._damaged(place, f"a record of kind {opcode} and {length} bytes")
            after = place + mcap.PREFIX.size + length
            if after > end:
                self._stop(place, f"a record of {length} bytes is cut")
                return
            yield opcode, place, length
            if opcode == mcap.DATA_END:
                return
            place = after

    def _stop(self, place: int, why: str) -> None:
        if self._end < self.size:
            raise self._damaged(place, why)
        self.torn = f"was not ended: {why} at byte {place} of {self.size}"

    def _chunk(self, offset: int) -> Chunk:
        with self._understood(offset):
            chunk = parse_chunk(self._body(offset), offset)
        if chunk.compression:
            raise DataError(
                f"its chunks are compressed ({chunk.compression}); those of a session are not",
                where=f"{self.where}, byte {offset}",
                hint="decompress it first: mcap decompress",
            )
        if zlib.crc32(chunk.records) != chunk.crc:
            raise self._damaged(offset, "the CRC of a chunk differs")
        return chunk

    def _body(self, offset: int) -> bytes:
        head = self._read(offset, mcap.PREFIX.size)
        if len(head) < mcap.PREFIX.size:
            raise self._damaged(offset, "an index points beyond the end")
        _, length = mcap.PREFIX.unpack(head)
        if length > min(LARGEST, self.size - offset - mcap.PREFIX.size):
            raise self._damaged(offset, f"a record of {length} bytes")
        return self._read(offset + mcap.PREFIX.size, length)

    def _read(self, place: int, length: int) -> bytes:
        try:
            self._file.seek(max(place, 0))
            return self._file.read(length)
        except OSError as error:
            reason = error.strerror or error
            raise DataError(f"cannot be read: {reason}", where=self.where) from error

    def _damaged(self, place: int, why: str) -> DataError:
        return DataError(f"is damaged: {why}", where=f"{self.where}, byte {place}", hint=MEND)

    @contextmanager
    def _understood(self, offset: int) -> Iterator[None]:
        """Turns what a malformed body raises into the reader's error."""
        try:
            yield
        except ValueError as error:
            raise self._damaged(offset, str(error)) from error
