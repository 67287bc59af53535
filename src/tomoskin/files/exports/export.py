"""A session as it is exported: replayed once more, with what was recorded beside the frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, Protocol, TypeVar

from tomoskin.core import DataError, StrPath
from tomoskin.files.exports.picture import Panel
from tomoskin.files.messages import Every, Item, Place, Reporter, Stream
from tomoskin.files.session import (
    Advance,
    SessionReader,
    as_recorded,
    indexed_frames,
    no_report,
    replayed,
)
from tomoskin.pipeline import FrameResult, Prepared

_T = TypeVar("_T")


class Wearer(Protocol):
    """What wears skins, and knows where they lie."""

    def place(self, name: str, path: StrPath) -> Place:
        """That of the skin called so, in a recording ``path``."""


@dataclass(frozen=True)
class Export:
    """A session to be exported.

    ``every`` s between two images; ``advance`` is called with how far it is. Files that are
    there are written over with ``overwrite`` only. ``others`` are the sessions of a robot's other
    skins, for formats that take several. ``options`` are records of what else a format takes.
    ``robot`` wore the skins, where it is known.
    """

    session: SessionReader
    every: float = 0.1
    advance: Advance = no_report
    overwrite: bool = False
    others: tuple[SessionReader, ...] = ()
    options: tuple[Any, ...] = ()
    robot: Wearer | None = None

    @cached_property
    def prepared(self) -> Prepared:
        """The skin and its calibrations as they are in the recording."""
        return as_recorded(self.session)

    @cached_property
    def stream(self) -> Stream:
        """What the run of the recording would have published."""
        session = self.session
        place = None if self.robot is None else self.robot.place(session.name, session.path)
        stream = Stream.of(self.prepared, str(session.path), session.epoch, place)
        return replace(stream, replayed=False)  # here events are those of the recording too

    def option(self, kind: type[_T]) -> _T | None:
        """The record of that ``kind`` among the options."""
        return next((one for one in self.options if isinstance(one, kind)), None)

    def each(self) -> Iterator[Export]:
        """The same export for each of the skins."""
        return (replace(self, session=one, others=()) for one in (self.session, *self.others))

    def results(self) -> Iterator[FrameResult]:
        """What a replay makes of each frame; ``advance`` is called as it goes."""
        total = indexed_frames(self.session)
        for done, result in enumerate(replayed(self.prepared, self.session)):
            self.advance(done, max(done + 1, total))
            yield result

    def items(self) -> Iterator[Item]:
        """What was recorded beside the frames, then each frame's contacts."""
        events = (event for event in self.session.events() if not event.kind.startswith("touch-"))
        yield from chain(events, self.session.notes())
        reporter = Reporter(self.stream, image_period=self.every)
        for result in self.results():
            yield reporter.of(result)

    def images(self) -> Iterator[FrameResult]:
        """A result every so often; those before the reference stands are left out."""
        is_due, shown = Every(self.every), False
        for result in self.results():
            if result.ready and is_due(result.host_time):
                shown = True
                yield result
        if not shown:
            raise DataError(
                "holds too few frames for a reference, so there are no images and no touches",
                where=str(self.session.path),
            )

    def panels(self) -> Iterator[Panel]:
        """The images with their touches, and the time since the first."""
        first: float | None = None
        for result in self.images():
            first = result.host_time if first is None else first
            title = f"{result.host_time - first:.1f} s"
            yield Panel(title, result.image.values, result.touches)


@dataclass(frozen=True)
class ExportFormat:
    """A format that sessions are exported to.

    Attributes
    ----------
    write
        Writes the file, or the folder, of that name.
    gives
        What a person gets, such as "a table of voltages".
    package
        What it is written by: the package, and the extra that brings it.
    several
        Whether all skins of a recording go into one.
    of_links
        Whether it says where a robot's links were, or which touches are its own.
    """

    write: Callable[[Export, Path], None]
    gives: str = ""
    package: tuple[str, str] = ("", "")
    several: bool = False
    of_links: bool = False
