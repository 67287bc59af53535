"""What a session would have had sinks publish, for files of other programs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

from tomoskin.files.session import indexed_frames, replayed
from tomoskin.pipeline import Prepared
from tomoskin.run.sinks.sink import Item, Moment, Stream

if TYPE_CHECKING:
    from tomoskin.files.exports import Export


def recorded_stream(job: Export, prepared: Prepared) -> Stream:
    """Of the session as it was recorded; ``prepared`` as in the recording."""
    stream = Stream.of(prepared, str(job.session.path), job.session.epoch)
    return replace(stream, replayed=False)  # here events are those of the recording too


def recorded_items(job: Export, prepared: Prepared) -> Iterator[Item]:
    """What was recorded beside the frames, then each frame's results and what happened in it.

    An image every ``job.every`` s.
    """
    told = (event for event in job.session.events() if not event.kind.startswith("touch-"))
    yield from chain(told, job.session.notes())
    total, due = indexed_frames(job.session), float("-inf")
    for done, result in enumerate(replayed(prepared, job.session)):
        job.advance(done, max(done + 1, total))
        shown = result.ready and result.has_image and result.host_time >= due
        if shown:
            due = result.host_time + job.every
        yield Moment.of(result, with_image=shown)
