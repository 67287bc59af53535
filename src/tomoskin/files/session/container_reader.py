"""An MCAP file read with suspicion: every length is checked, every chunk's CRC is compared."""

from __future__ import annotations

import io
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Self

from mcap.opcode import Opcode
from mcap.records import Attachment, Footer, Metadata

from tomoskin.core import EMPTY, MAGIC, DataError, open_input, read_refusals
from tomoskin.files.session import mcap_records

MEND = "tomoskin session repair recovers all whole chunks"
"""What to do about a damaged file."""

_END = "tomoskin session repair completes it"

_FOOTER_BYTES = len(mcap_records.encode(Footer(0, 0, 0)))


class ContainerReader:
    """Reads one MCAP file.

    A file without its end, as a killed program leaves it, is read up to where it is torn, and
    :attr:`torn` says where. Damage inside is an error that names the byte.

    Attributes
    ----------
    torn
        A sentence on what is missing at the end, or "".
    summary
        Totals and index of all messages; None in a file without its end.
    first
        What is taken off the numbers of channels: 0, but for a part of the file.

    Raises
    ------
    DataError
        When the file cannot be read, is no MCAP file, or is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.where, self.torn = str(path), ""
        self._prefix, self.first = "", 0
        self.summary: mcap_records.Summary | None = None
        self._file = open_input(path, buffering=1 << 18)
        self.size = self._end = self._file.seek(0, io.SEEK_END)
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file; nothing can be read afterwards."""
        self._file.close()

    def part(self, name: str, first: int) -> Self:
        """One of several sessions in this file: names that begin so, channels from ``first`` on."""
        part = copy(self)
        part._prefix, part.first = f"{name}/", first
        return part

    def description(self, name: str) -> dict[str, str] | None:
        """The named strings of that name; those of the file itself are before the first chunk."""
        for opcode, offset in self._records():
            if opcode == Opcode.CHUNK and not self._prefix:
                break
            if opcode == Opcode.METADATA:
                with self._damage_at(offset):
                    record = mcap_records.decode(Metadata, self._record(offset))
                if record.name == self._prefix + name:
                    return record.metadata
        return None

    def attachments(self) -> Iterator[Attachment]:
        """Every file inside: by the index, or by going through the whole file."""
        offsets: Iterable[int]
        if self.summary is None:
            offsets = (place for opcode, place in self._records() if opcode == Opcode.ATTACHMENT)
        else:
            offsets = self.summary.attachments
        for offset in offsets:
            with self._damage_at(offset):
                record = mcap_records.decode(Attachment, self._record(offset))
            if record.name.startswith(self._prefix):
                yield replace(record, name=record.name.removeprefix(self._prefix))

    def messages(
        self, channels: frozenset[int], since: int = 0
    ) -> Iterator[mcap_records.LoggedMessage]:
        """Messages of the channels ``wanted`` logged at ``since`` ns or later, in file order.

        Of a file with its end only the chunks that hold such messages are read.
        """
        for offset in self._chunk_offsets(channels, since):
            for message in self._messages_at(offset):
                if message.channel in channels and message.log_time >= since:
                    yield message

    def last(self, channel: int) -> mcap_records.LoggedMessage | None:
        """The last message of a channel in the file."""
        channels = frozenset({channel})
        if self.summary is None:
            return next(iter(deque(self.messages(channels), maxlen=1)), None)
        for offset in reversed(list(self._chunk_offsets(channels, 0))):
            for message in reversed(list(self._messages_at(offset))):
                if message.channel == channel:
                    return message
        return None

    def _chunk_offsets(self, channels: frozenset[int], since: int) -> Iterator[int]:
        if self.summary is None:
            yield from (place for opcode, place in self._records() if opcode == Opcode.CHUNK)
            return
        with self._damage_at(self._end):
            own = frozenset(self.first + channel for channel in channels)
            yield from self.summary.chunks(own, since)

    def _messages_at(self, offset: int) -> Iterator[mcap_records.LoggedMessage]:
        with self._damage_at(offset):
            chunk = mcap_records.decode_chunk(self._record(offset))
        if chunk.compression:
            raise DataError(
                f"its chunks are compressed ({chunk.compression}), but tomoskin reads only "
                "uncompressed ones",
                where=f"{self.where}, byte {offset}",
                hint="decompress it first: mcap decompress",
            )
        with self._damage_at(offset):
            yield from mcap_records.messages_in(chunk, offset, self.first)

    def _open(self) -> None:
        """Read the summary, where the file has its end."""
        if not self.size:
            raise DataError(EMPTY, where=self.where)
        if self._read(0, len(MAGIC)) != MAGIC:
            raise DataError(
                "is not an MCAP file",
                where=self.where,
                hint="convert a recording of another program by tomoskin session import; "
                "tomoskin image reads voltages of .npz and .csv",
            )
        end = self.size - _FOOTER_BYTES - len(MAGIC)
        tail = self._read(end, _FOOTER_BYTES + len(MAGIC))
        try:
            footer = mcap_records.decode(Footer, tail.removesuffix(MAGIC))
        except ValueError:
            stop = "the program or the computer stopped during the recording"
            self.torn = f"is incomplete: {stop} ({_END})"
            return
        self._end, start = end, footer.summary_start
        if not start:
            return
        with self._damage_at(start):
            if not len(MAGIC) <= start <= footer.summary_offset_start <= end:
                raise ValueError("the index is not in the file")
            if end - start > mcap_records.LARGEST_SUMMARY:
                raise ValueError(f"an index of {end - start} bytes")
            self.summary = mcap_records.decode_summary(footer, self._read(start, end - start))

    def _records(self) -> Iterator[tuple[int, int]]:
        """(opcode, offset) from the first record on; ends where the file is torn."""
        place = len(MAGIC)
        while place + mcap_records.PREFIX.size <= self._end:
            opcode, length = mcap_records.PREFIX.unpack(self._read(place, mcap_records.PREFIX.size))
            if length > mcap_records.LARGEST or not opcode:
                raise self._damage(place, f"a record of kind {opcode} and {length} bytes")
            after = place + mcap_records.PREFIX.size + length
            if after > self._end:
                break
            yield opcode, place
            if opcode == Opcode.DATA_END:
                return
            place = after
        if place < self._end < self.size:
            raise self._damage(place, "a record is cut off")
        if place < self._end:
            cut = f"a record is cut off at byte {place} of {self.size}"
            self.torn = f"is incomplete: {cut} ({_END})"

    def _record(self, offset: int) -> bytes:
        """A whole record; ValueError where it would go beyond the end."""
        head = self._read(offset, mcap_records.PREFIX.size)
        length = (
            mcap_records.PREFIX.unpack(head)[1]
            if len(head) == mcap_records.PREFIX.size
            else self.size
        )
        if length > min(mcap_records.LARGEST, self.size - offset - mcap_records.PREFIX.size):
            raise ValueError(f"a record of {length} bytes extends beyond the end of the file")
        return self._read(offset, mcap_records.PREFIX.size + length)

    def _read(self, place: int, length: int) -> bytes:
        with read_refusals(self.where):
            self._file.seek(max(place, 0))
            return self._file.read(length)

    def _damage(self, place: int, why: str) -> DataError:
        return DataError(f"is damaged: {why}", where=f"{self.where}, byte {place}", hint=MEND)

    @contextmanager
    def _damage_at(self, offset: int) -> Iterator[None]:
        """ValueError of a record → the reader's error."""
        try:
            yield
        except ValueError as error:
            raise self._damage(offset, str(error)) from error
