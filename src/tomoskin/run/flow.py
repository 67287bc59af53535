"""The frames of one skin and source: what becomes of each, what is made of it, what was lost."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass

from tomoskin.board.source import Link, ScanSettings, Transport
from tomoskin.board.wire import Info
from tomoskin.core import Event, Frame, TomoskinError
from tomoskin.files.session import BoardInfo, Mark, MarkedFrame, RawRead, Truth, advance
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, ReferenceState
from tomoskin.run.backlog import Backlog
from tomoskin.run.counters import Latency, Losses
from tomoskin.run.frame_cost import CostMeter
from tomoskin.run.marker import Marker, replay_status
from tomoskin.run.publisher import Audience, Publisher
from tomoskin.run.recall import Recall
from tomoskin.run.repeats import Repeats
from tomoskin.run.status import Status
from tomoskin.run.twin_control import TwinControl, described
from tomoskin.twin import Contact

_STANDSTILL = frozenset({"silent", "fault", "reset"})
"""Events after which no frame comes until the board is well again."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A result, the presses on the twin when it was read, its latency in s, and when it was
    ready, host monotonic s."""

    result: FrameResult
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
    board
        What the board said of itself, once it has.
    pipeline, marker, twin, out
        What makes results, what marks frames, what presses the source, and where messages go.
    latency, costs
        How long all that takes, and what the slowest frames took it for.
    """

    def __init__(self, prepared: Prepared, audience: Audience) -> None:
        self.prepared = prepared
        self.newest: Snapshot | None = None
        self.source = ""
        self.board: Info | None = None
        self.board_name = ""
        self.pipeline, self.marker, self.twin = Pipeline(prepared), Marker(), TwinControl()
        self.out = Publisher(prepared, audience, lambda: self.pipeline.numbered)
        self.latency, self.costs = Latency(), CostMeter(time.perf_counter)
        self._clock, self._turns = audience.clock, audience.turns
        self._recall, self._backlog = Recall(audience.memory), Backlog()
        self._settings = ScanSettings.of(prepared.skin)
        self._losses, self._earlier, self._skipped = Losses(), Losses(), 0
        self._drops, self._polled, self._waited = 0, 0.0, 0.0
        self._standstill: str | None = None
        self._saturated: str | None = None
        self._repeats = Repeats()
        self._ended = False

    def now(self) -> float:
        """Monotonic time of the host, s."""
        return self._clock()

    def begin(self, transport: Transport) -> None:
        """Its source has been opened for the first time; say what it is."""
        self.marker.begin(transport)
        self.twin.attach(transport)
        skin, name = self.prepared.skin.name, transport.name
        self.source = f"{name} of {skin}" if self.twin.pressable else f"{skin} on {name}"
        replay = self.marker.replay
        self.out.begin(self.prepared, self.source, replay.epoch if replay else None)
        self._saturated = self.prepared.headroom.problem
        if self._saturated is not None:
            self.out.say("saturated", self._saturated)

    def link(self, transport: Transport) -> Link:
        """The protocol session with its source, which has just been opened, maybe again."""
        self._standstill, self._drops = None, 0
        self.marker.begin(transport)
        self.twin.attach(transport)
        if self.marker.replay:
            self.pipeline.collect(self.marker.replay.reference_frames)
            self.pipeline.number_after(self.marker.replay.touches_before)
        return Link(
            transport,
            self.prepared.scan,
            self._settings,
            clock=self._clock,
            tap=lambda host_time, data: self.out.put(RawRead(host_time, data)),
        )

    def unlink(self) -> None:
        """The protocol session is over; another may follow."""
        self._earlier, self._losses = self._earlier + self._losses, Losses()

    def adopt(self, prepared: Prepared) -> Future[None] | None:
        """Go on with other settings; nothing is done where they are of another sheet or scan."""
        if prepared.skin.body != self.prepared.skin.body:
            return None
        ended = self.out.recordings.adopt(prepared)
        self.prepared = prepared
        self.pipeline.adopt(prepared)
        return ended

    def press(self) -> None:
        """Let the source feel what is pressed now."""
        before = self.twin.refusals
        if self.twin.press():
            presses = tuple(map(described, self.twin.truth))
            self.out.put(Truth(self._clock(), presses, self.twin.pose.truth))
            for why in dict.fromkeys(self.twin.refusals):
                if why not in before:
                    self.out.say("press-refused", f"a press is left out: {why}")

    def take(self, link: Link, items: Sequence[Frame | Event]) -> None:
        """What one read of the link brought: frames and events."""
        self._polled, self._waited = self._clock(), link.waited
        self._note_board(link.info, link.board.text if link.board else "")
        frames = [item for item in items if isinstance(item, Frame)]
        self._drops = frames[-1].drops if frames else self._drops
        self._losses = Losses.of(link, self._drops)
        events = [item for item in items if isinstance(item, Event)]
        for event in events:
            if event.kind in _STANDSTILL:
                self._standstill = event.text
        if items:
            self._say(items[-1].host_time, events)
        self._take_frames(frames)
        self._end()

    def status(self, trouble: str | None) -> Status:
        """How it is doing now; ``trouble``: why there is no source, or None."""
        now, replay = self._clock(), self.marker.replay
        p50, p99 = self.latency.age()
        reference = self.pipeline.reference_state
        result = self.newest.result if self.newest else None
        total = self._earlier + self._losses
        here = replay.now() if replay else now
        return Status(
            source=self.source,
            running=trouble is None and self._standstill is None,
            paused=self.marker.held,
            recording=self.out.recordings.path,
            sinks=self.out.sink_reports(),
            replay=replay_status(replay, ended=self._ended) if replay else None,
            frames=self.latency.frames,
            fps=self.latency.rate(now),
            dropped=total.dropped + self._skipped + self.pipeline.refused,
            corrupt=total.corrupt,
            gaps=total.gaps,
            p50=p50,
            p99=p99,
            stages=self.latency.stages(),
            slowest=self.costs.slowest,
            reference=reference,
            reference_age=None if reference.since is None else here - reference.since,
            choice=self.pipeline.choice,
            left_out=result.left_out if result else 0,
            electrodes=result.health.sick if result and result.health else (),
            bend=result.bend if result and result.ready else None,
            class_reading=result.class_reading if result and result.ready else None,
            calibration=result.calibration if result and result.ready else None,
            problem=trouble
            or self._standstill
            or self._saturated
            or (result.problem if result else None)
            or self._recall.problem
            or _doubt(self.prepared, reference),
            board=self.board,
            board_name=self.board_name,
        )

    def remember(self) -> None:
        """Keep what the next start of this board begins with."""
        if self._recall.is_due(self._clock(), at_end=True):
            self._recall.keep(self.prepared, self.out)

    def _note_board(self, info: Info | None, name: str) -> None:
        if info is self.board:
            return
        self.board, self.board_name = info, name
        if info is None:
            return
        self.out.put(BoardInfo(self._clock(), info, name))
        if info.tick_rate:
            self.pipeline.tick_rate = info.tick_rate
        if self.marker.replay is None:
            self._recall.meet(info, self)

    def _end(self) -> None:
        """A replay has ended when its last frames have been processed, not when they were read."""
        replay = self.marker.replay
        ended = replay is not None and replay.ended
        if ended != self._ended:
            self._ended = ended
            self.out.wake()

    def _say(self, now: float, events: Sequence[Event]) -> None:
        """Publish what happens, and what happens again and again once a second."""
        for event in self._repeats.push(now, events):
            self.out.put(event)

    def _take_frames(self, frames: Sequence[Frame]) -> None:
        late = self._backlog.late(len(frames), self._waited) if frames else 0
        for number, frame in enumerate(frames):
            mark = self.marker.mark(frame, late=number < late)
            if mark is not None:
                for before in self.out.recordings.again():
                    advance(self.pipeline, *before)
                self.out.put(MarkedFrame(frame, mark))
                with self._turns:
                    self._take_frame(frame, mark)

    def _take_frame(self, frame: Frame, mark: Mark) -> None:
        if mark & Mark.SKIPPED:
            self._skipped += 1
            return
        self._standstill = None
        # the times in a replay are the recording's
        read, begun = self._polled if self.marker.replay else frame.host_time, self._clock()
        self.latency.add_frame(frame, read, self.pipeline.tick_rate)
        self.latency.add("decode", begun - read + self._waited)
        try:
            with self.costs.of(frame):
                result = advance(self.pipeline, frame, mark)
        except TomoskinError as error:  # of this frame: the source is well
            self._skipped += 1
            refused = Event(frame.host_time, "refused", f"a frame was left out: {error}")
            self._say(frame.host_time, [refused])
            return
        if result is None:
            return
        ready = self._clock()
        self.latency.add_age(ready - read + self._waited)
        self.latency.add("reconstruct", ready - begun)
        self.newest = Snapshot(result, self.twin.truth, ready - read + self._waited, ready)
        self._recall.see(result, self)
        self.out.put(result)


def _doubt(prepared: Prepared, reference: ReferenceState) -> str | None:
    """Whether the reference is this skin's, where positions rest on its model."""
    if any(c.kind.locates for c in prepared.calibrations.values()):
        return None
    return reference.agreement.doubt(volts=True)
