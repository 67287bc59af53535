"""The frames of one skin and source: what becomes of each, what is made of it, what was lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tomoskin.core import DataError, Event, Frame
from tomoskin.pipeline import Pipeline, Prepared, Result
from tomoskin.recording import Mark, advance
from tomoskin.run.counters import Tally
from tomoskin.run.latency import Latency
from tomoskin.run.meter import Meter
from tomoskin.run.presses import Hands, Pressable
from tomoskin.run.publisher import Audience, Publisher
from tomoskin.run.replay_place import where_is
from tomoskin.run.status import Status
from tomoskin.run.wishes import Wishes
from tomoskin.source import Link, ScanSettings, Transport
from tomoskin.twin import Contact

MOST_AT_ONCE = 16
"""Where more frames than this wait, the oldest are skipped: a late picture helps nobody."""

_STANDSTILL = frozenset({"silent", "fault", "reset"})
"""Events after which no frame comes until the board is well again."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A result, the presses on the twin when it was read, its latency in s, and when it was
    ready, host monotonic s."""

    result: Result
    truth: tuple[Contact, ...]
    latency: float
    ready: float


class Flow:
    """Feeds a pipeline, from the first frame of a skin and source to the last.

    Attributes
    ----------
    prepared
        The skin, as it is set now.
    newest
        The newest result, or None before the first.
    source
        Source and skin in words, once it has been opened.
    pressable
        Whether the source can be pressed, as the twin can.
    pipeline, wishes, hands, out, latency
        What makes results, what is wanted of it, who presses the source, who is told, and how
        long all that takes.
    """

    def __init__(self, prepared: Prepared, audience: Audience) -> None:
        self.prepared = prepared
        self.newest: Snapshot | None = None
        self.source, self.pressable = "", False
        self.pipeline, self.wishes, self.hands = Pipeline(prepared), Wishes(), Hands()
        self.out = Publisher(prepared, audience, lambda: self.pipeline.numbered)
        self.latency = Latency()
        self._clock = audience.clock
        self._settings = ScanSettings.of(prepared.skin)
        self._meter = Meter()
        self._tally, self._earlier, self._skipped = Tally(), Tally(), 0
        self._drops, self._polled = 0, 0.0
        self._standstill: str | None = None
        self._ended = False

    def opened(self, transport: Transport) -> None:
        """Its source has been opened for the first time; say what it is."""
        self.wishes.opened(transport)
        self.pressable = isinstance(transport, Pressable)
        skin, name = self.prepared.skin.name, transport.name
        self.source = f"{name} of {skin}" if self.pressable else f"{skin} on {name}"
        self.out.opened(self.prepared, self.source)

    def link(self, transport: Transport) -> Link:
        """The link to its source, which has just been opened, maybe again."""
        self._standstill, self._drops = None, 0
        self.wishes.opened(transport)
        self.hands.opened(transport)
        if self.wishes.replay:
            self.pipeline.number_after(self.wishes.replay.touches_before)
        clock, tap = self._clock, self.out.tape.read
        return Link(transport, self.prepared.scan, self._settings, clock=clock, tap=tap)

    def unlinked(self) -> None:
        """The link is closed; another may follow."""
        self._earlier, self._tally = self._earlier + self._tally, Tally()

    def adopt(self, prepared: Prepared) -> None:
        """Go on with other settings; nothing is done where they are of another sheet or scan."""
        if prepared.skin.body == self.prepared.skin.body:
            self.out.tape.adopt(prepared)
            self.prepared = prepared
            self.pipeline.adopt(prepared)

    def press(self, transport: Transport) -> None:
        """Let the source feel what is pressed now."""
        if isinstance(transport, Pressable) and self.hands.press(transport):
            self.out.tape.truth(self.hands.truth, self.hands.posed.told)

    def take(self, link: Link, found: Sequence[object]) -> None:
        """What one read of the link brought: frames and events."""
        self._polled = self._clock()
        self.out.tape.linked(link)
        if link.info is not None and link.info.tick_rate:
            self.pipeline.tick_rate = link.info.tick_rate
        frames = [item for item in found if isinstance(item, Frame)]
        self._drops = frames[-1].drops if frames else self._drops
        self._tally = Tally.of(link, self._drops)
        for event in (item for item in found if isinstance(item, Event)):
            self.out.event(event)
            if event.kind in _STANDSTILL:
                self._standstill = event.text
        self._frames(frames)
        self._end()

    def _end(self) -> None:
        """A replay has ended when its last frames have been processed, not when they were read."""
        replay = self.wishes.replay
        ended = replay is not None and replay.ended
        if ended != self._ended:
            self._ended = ended
            self.out.announce()

    def _frames(self, frames: Sequence[Frame]) -> None:
        late = len(frames) - MOST_AT_ONCE
        for number, frame in enumerate(frames):
            mark = self.wishes.mark(frame, late=number < late)
            if mark is not None:
                for before in self.out.tape.again():
                    advance(self.pipeline, *before)
                self.out.tape.frame(frame, mark)
                self._frame(frame, mark)

    def _frame(self, frame: Frame, mark: Mark) -> None:
        if mark & Mark.SKIPPED:
            self._skipped += 1
            return
        self._standstill = None
        read, begun = self._read(frame), self._clock()
        self._meter.arrived(read)
        self.latency.sampled(frame, self.pipeline.tick_rate)
        self.latency.took("decode", begun - read)
        try:
            result = advance(self.pipeline, frame, mark)
        except DataError as error:
            self._skipped += 1
            self.out.say("refused", f"a frame was left out: {error}")
            return
        if result is None:
            return
        ready = self._clock()
        self._meter.took(ready - read)
        self.latency.took("reconstruct", ready - begun)
        self.newest = Snapshot(result, self.hands.truth, ready - read, ready)
        self.out.result(result)

    def _read(self, frame: Frame) -> float:
        """When its last byte was read, by our clock; the times in a replay are the recording's."""
        return self._polled if self.wishes.replay else frame.host_time

    def note(self, text: str) -> None:
        """A person's remark on the picture of this moment; from any thread."""
        newest = self.newest
        self.out.note(Event(newest.result.host_time if newest else self._clock(), "note", text))

    def status(self, trouble: str | None) -> Status:
        """How it is doing now; ``trouble``: why there is no source, or None."""
        now, replay = self._clock(), self.wishes.replay
        p50, p99 = self._meter.latency()
        reference = self.pipeline.reference_state
        result = self.newest.result if self.newest else None
        total = self._earlier + self._tally
        here = replay.now() if replay else now
        return Status(
            source=self.source,
            running=trouble is None and self._standstill is None,
            paused=self.wishes.held,
            recording=self.out.tape.path,
            sinks=self.out.sink_reports(),
            replay=where_is(replay, ended=self._ended) if replay else None,
            frames=self._meter.frames,
            fps=self._meter.rate(now),
            dropped=total.dropped + self._skipped + self.pipeline.refused,
            corrupt=total.corrupt,
            gaps=total.gaps,
            p50=p50,
            p99=p99,
            stages=self.latency.stages(),
            reference=reference,
            reference_age=None if reference.since is None else here - reference.since,
            choice=self.pipeline.choice,
            left_out=result.left_out if result else 0,
            electrodes=result.health.sick if result and result.health else (),
            bend=result.bend if result and result.ready else None,
            state=result.state if result and result.ready else None,
            problem=trouble or self._standstill or (result.problem if result else None),
        )
