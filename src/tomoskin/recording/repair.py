"""What is whole in a damaged session file → a new file; the damaged one is only read."""

from __future__ import annotations

import re
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from tomoskin.core import MAGIC, DataError, Output, SkinError, check_outputs, written
from tomoskin.recording import channels, mcap
from tomoskin.recording.container import SEEK_TABLE, ContainerWriter
from tomoskin.recording.container_reader import LARGEST
from tomoskin.recording.parts import (
    Attachment,
    Chunk,
    messages_in,
    parse_attachment,
    parse_chunk,
    parse_metadata,
)
from tomoskin.recording.writer import ABOUT, FORMAT, LIBRARY, SKIN_FILE, said_of
from tomoskin.skin import Skin

Advance = Callable[[float, float], None]

_WINDOW = 1 << 20
_BEGINNING = re.compile(rb"(?=[\x06\x09\x0c].{3}\x00{5})", re.DOTALL)
"""Kind and length of a chunk, attachment or named strings of up to 16 MiB."""

_KNOWN = frozenset(range(mcap.HEADER, mcap.DATA_END + 1))


@dataclass(frozen=True, slots=True)
class Lost:
    """A stretch of bytes that nothing could be made of, and the log times (ns) around it."""

    start: int
    stop: int
    after: int
    before: int | None


@dataclass
class Repaired:
    """What a repair kept and what it did not.

    ``messages`` kept by topic; ``chunks`` kept; ``lost`` stretches of the file; ``ended`` whether
    the file had its end.
    """

    path: Path
    messages: Counter[str] = field(default_factory=Counter)
    chunks: int = 0
    lost: list[Lost] = field(default_factory=list)
    ended: bool = False


def repair(
    source: Path,
    target: Path,
    *,
    skin: Skin | None = None,
    advance: Advance = lambda _done, _total: None,
) -> Repaired:
    """Write every whole chunk of ``source`` to the new file ``target``, which appears at the end.

    Parameters
    ----------
    skin
        Used where the file's own skin is lost.

    Raises
    ------
    OutputError
        When the target exists or cannot be made.
    DataError
        When the source cannot be read or nothing in it is whole, the target cannot be written, or
        the skin is lost and none is given.
    """
    check_outputs([Output(target)], [source])
    if not source.exists():
        raise DataError("there is no such file", where=str(source))
    found = Repaired(target)
    with said_of(source), source.open("rb") as file:
        scan = _Scan(file, found)
        front = _front(scan, skin, str(source))
        with written(target) as part:
            _mend(scan, front, part, advance)
            if not found.chunks:
                raise DataError("holds no whole chunk: nothing can be recovered", where=str(source))
    return found


Front = tuple[dict[str, str], list[Attachment]]
"""The named strings of a file, and its attachments."""


def _mend(scan: _Scan, front: Front, target: Path, advance: Advance) -> None:
    """What is whole in the file that is scanned → ``target``."""
    about, attachments = front
    output = target.open("wb", buffering=0)
    with closing(ContainerWriter(output, LIBRARY, channels.SCHEMAS, channels.CHANNELS)) as mended:
        mended.describe(ABOUT, about)
        for item in attachments:
            mended.attach(item.name, item.media_type, item.data)
        for part in scan.parts():
            if isinstance(part, Chunk):
                _copy(part, mended, scan.found, scan.name)
                advance(part.offset, scan.size)


def _front(scan: _Scan, skin: Skin | None, where: str) -> Front:
    """The named strings and the attachments, wherever they are in the file."""
    about: dict[str, str] = {}
    attachments: dict[str, Attachment] = {}
    seen = False
    for part in scan.parts():
        seen = True
        if isinstance(part, Attachment) and part.name != SEEK_TABLE:
            attachments[part.name] = part
        elif isinstance(part, dict):
            about = part
    if not seen:
        raise DataError("holds no part of a session: nothing can be recovered", where=where)
    if skin is None:
        skin = _skin_of(attachments.get(SKIN_FILE), where)
    attachments[SKIN_FILE] = Attachment(SKIN_FILE, "application/toml", skin.to_toml().encode())
    scan.begin()
    return about or {"format": str(FORMAT), "epoch_s": "0.0"}, list(attachments.values())


def _skin_of(attachment: Attachment | None, where: str) -> Skin:
    if attachment is not None:
        try:
            return Skin.from_toml(attachment.data.decode(), source=f"{where}, {SKIN_FILE}")
        except (SkinError, UnicodeDecodeError):
            pass  # the same as no skin
    raise DataError("its skin is lost", where=where, hint="name the skin: --skin")


def _copy(chunk: Chunk, container: ContainerWriter, found: Repaired, where: str) -> None:
    for message in messages_in(chunk, where):
        if message.channel in channels.TOPICS:
            container.message(message.channel, message.log_time, message.data)
            found.messages[channels.TOPICS[message.channel]] += 1
    found.chunks += 1


class _Scan:
    """Goes through a file record by record, and to the next whole one where that fails."""

    def __init__(self, file: BinaryIO, found: Repaired) -> None:
        self._file, self.found = file, found
        self.name = str(file.name)
        self.size = file.seek(0, 2)
        self.begin()

    def begin(self) -> None:
        """Forget what was found to be lost."""
        self.found.lost.clear()
        self.found.ended = False

    def parts(self) -> Iterator[Chunk | Attachment | dict[str, str]]:
        """Every whole chunk, attachment and description, in order."""
        place = len(MAGIC) if self._read(0, len(MAGIC)) == MAGIC else 0
        after = 0
        while place < self.size:
            length = self._length(place)
            part = self._whole(place, length) if length else None
            if part is None and (not length or self._is_data(place)):
                after_gap = self._next(place + 1)
                self._lose(place, after_gap, after)
                place = after_gap
                continue
            if isinstance(part, Chunk):
                after = part.last
                self._bound(part.first)
            if part is not None:
                yield part
            if self._read(place, 1)[0] == mcap.DATA_END:
                self.found.ended = True
                return
            place += length

    def _length(self, place: int) -> int:
        """Bytes of the record there; 0 where there can be none."""
        head = self._read(place, mcap.PREFIX.size)
        if len(head) < mcap.PREFIX.size:
            return 0
        opcode, length = mcap.PREFIX.unpack(head)
        whole = mcap.PREFIX.size + int(length)
        fits = length <= LARGEST and place + whole <= self.size
        return whole if opcode in _KNOWN and fits else 0

    def _is_data(self, place: int) -> bool:
        return self._read(place, 1)[0] in (mcap.CHUNK, mcap.ATTACHMENT)

    def _whole(self, place: int, length: int) -> Chunk | Attachment | dict[str, str] | None:
        """What stands there, when it is whole and of a kind that is kept."""
        opcode = self._read(place, 1)[0]
        body = self._read(place + mcap.PREFIX.size, length - mcap.PREFIX.size)
        try:
            if opcode == mcap.CHUNK:
                chunk = parse_chunk(body, place)
                return chunk if zlib.crc32(chunk.records) == chunk.crc else None
            if opcode == mcap.ATTACHMENT:
                return parse_attachment(body)
            if opcode == mcap.METADATA:
                name, values = parse_metadata(body)
                return values if name == ABOUT else None
        except ValueError:
            return None
        return None

    def _next(self, place: int) -> int:
        """Where the next whole record of data begins, or the end of the file."""
        while place < self.size:
            window = self._read(place, _WINDOW + 9)
            for match in _BEGINNING.finditer(window):
                start = place + match.start()
                length = self._length(start)
                if length and self._whole(start, length) is not None:
                    return start
            place += _WINDOW
        return self.size

    def _lose(self, start: int, stop: int, after: int) -> None:
        self.found.lost.append(Lost(start, stop, after, None))

    def _bound(self, first: int) -> None:
        """The last stretch lost ends before ``first``."""
        lost = self.found.lost
        if lost and lost[-1].before is None:
            lost[-1] = Lost(lost[-1].start, lost[-1].stop, lost[-1].after, first)

    def _read(self, place: int, length: int) -> bytes:
        self._file.seek(place)
        return self._file.read(length)
