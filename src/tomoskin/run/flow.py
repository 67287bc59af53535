"""The frames of one skin and source: what becomes of each, what is made of it, what was lost."""

from __future__ import annotations

import math
import time
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from tomoskin.board.source import Link, Received, ScanSettings, Transport
from tomoskin.board.wire import Info
from tomoskin.core import DriveSamples, Event, Frame, Mark, MarkedFrame, TomoskinError
from tomoskin.files.messages import NO_REFERENCE, Contacts, without_frame
from tomoskin.files.session import BoardInfo, RawRead, Truth
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, ReferenceState
from tomoskin.run.intake import Intake, Marker, replay_status
from tomoskin.run.publisher import Audience, Publisher
from tomoskin.run.status import CostMeter, Latency, ReplayStatus, Status
from tomoskin.run.twin_control import TwinControl, described
from tomoskin.twin import Press, Probe


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A result, the presses on the twin when it was read (of a replay those that it recorded), its
    latency in s, and when it was ready, host monotonic s."""

    result: FrameResult
    truth: tuple[Probe, ...]
    latency: float
    ready: float


News = tuple[Snapshot | None, str | None]
"""The newest result, and why no others come; None where there is none."""


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
    intake, turns
        What comes from the source, and when it may compute.
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
        self.out = Publisher(
            prepared, audience, lambda: self.pipeline.numbered, partial(_board, self)
        )
        self.latency, self.costs = Latency(), CostMeter(time.perf_counter)
        self._clock, self.turns, self._early = audience.clock, audience.turns, audience.early
        self.intake = Intake()
        self._ended = False
        self._board_id: bytes | None = None

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
        if (saturated := self.prepared.headroom.problem) is not None:
            self.out.say("saturated", saturated)

    def link(self, transport: Transport) -> Link:
        """The protocol session with its source, which has just been opened, maybe again."""
        self.intake.open()
        self.marker.begin(transport)
        self.twin.attach(transport)
        if self.marker.replay:
            self.pipeline.collect(self.marker.replay.reference_frames)
            self.pipeline.number_after(self.marker.replay.touches_before)
        singly = self._early and self.marker.replay is None
        return Link(
            transport,
            self.prepared.scan,
            replace(ScanSettings.of(self.prepared.skin), singly=singly),
            clock=self._clock,
            tap=lambda host_time, data: self.out.put(RawRead(host_time, data)),
        )

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

    def take(self, link: Link, items: Sequence[Received]) -> None:
        """What one read of the link brought: frames, drives of the next one, and events.

        Where others of the robot's skins compute first, what comes meanwhile is read before
        anything is computed: a frame would be as old as the turns of all others.
        """
        if not any(isinstance(item, Frame | DriveSamples) for item in items):
            self._take(link, items)
            return
        with self.turns.turn(link.keep_alive) as waited:
            more: Sequence[Received] = ()
            try:
                more = link.poll(0.0) if waited else ()
            finally:  # what has been read counts, even where the source is lost now
                self._take(link, [*items, *more])

    def _take(self, link: Link, items: Sequence[Received]) -> None:
        intake, out = self.intake, self.out
        frames = intake.take(link, items, self._clock())
        info, board = link.session.info, link.session.board
        if info is not self.board:
            self._note_board(info, board.text if board else "")
        if items:
            for event in intake.repeats.push(items[-1].host_time, items):
                out.put(event)
        late = intake.backlog.late(frames, intake.waited) if frames else 0
        drives = [item for item in items if isinstance(item, DriveSamples)]
        for item in items:
            if isinstance(item, DriveSamples):
                _tell_drive(self, item, late=item is not drives[-1])
            elif isinstance(item, Frame):
                link.keep_alive()  # as long as the frames before may take
                self._mark(item, late=late > 0)
                late -= 1
        replay = self.marker.replay
        if replay is not None and replay.ended != self._ended:
            self._ended = replay.ended  # when its last frames have been processed, not when read
            if replay.ended and replay.damage is not None:
                out.say("replay-damaged", f"the replay ends here: {replay.damage}")
            out.wake()

    def contacts(self, news: News) -> Contacts:
        """A result as it leaves the program, not valid where no others come."""
        stream, (newest, trouble) = self.out.stream, news
        if newest is None:
            return without_frame(stream, trouble or NO_REFERENCE, self.now())
        played = None
        if stream.replayed:  # as if its scan had been read when it was played
            scan_time = newest.result.scan_time
            half = 0.0 if math.isnan(scan_time) else scan_time / 2
            played = newest.ready - newest.latency - half
        contacts = Contacts.of(stream, newest.result, played)
        return contacts if trouble is None else contacts.outdated(trouble)

    @property
    def played(self) -> ReplayStatus | None:
        """Where a replay is; None where the source is another."""
        replay = self.marker.replay
        return replay_status(replay, ended=self._ended) if replay else None

    def status(self, trouble: str | None) -> Status:
        """How it is doing now; ``trouble``: why there is no source, or None."""
        now, replay = self._clock(), self.marker.replay
        p50, p99 = self.latency.age()
        reference = self.pipeline.reference_state
        result = self.newest.result if self.newest else None
        losses, standstill = self.intake.losses, self.intake.standstill
        here = replay.now() if replay else now
        return Status(
            source=self.source,
            running=trouble is None and standstill is None,
            paused=self.marker.held,
            recording=self.out.recordings.path,
            sinks=self.out.sink_reports(),
            replay=self.played,
            frames=self.latency.frames,
            fps=self.latency.rate(now),
            dropped=_dropped(self),
            corrupt=losses.corrupt,
            gaps=losses.gaps,
            late=losses.late,
            deaf=losses.deaf,
            p50=p50,
            p99=p99,
            stages=self.latency.stages(),
            slowest=self.costs.slowest,
            reference=reference,
            reference_age=None if reference.since is None else here - reference.since,
            choice=self.pipeline.choice,
            left_out=result.left_out if result else 0,
            electrodes=result.health.sick if result and result.health else (),
            readings=result.shown_readings if result and result.ready else {},
            calibration=result.calibration if result and result.ready else None,
            problem=trouble
            or standstill
            or (self.prepared.headroom.problem if self.source else None)
            or (result.problem if result else None)
            or _doubt(self.prepared, reference),
            board=self.board,
            board_name=self.board_name,
        )

    def _note_board(self, info: Info | None, name: str) -> None:
        self.board, self.board_name = info, name
        if info is None:
            return
        self.out.put(BoardInfo(self._clock(), info, name))
        if info.tick_rate:
            self.pipeline.tick_rate = info.tick_rate
        before, self._board_id = self._board_id, info.unique_id
        if self.marker.replay is None and before not in (None, info.unique_id):
            self.out.say("other-board", "another board answers: a new reference is taken")
            self.marker.reference = True

    def _mark(self, frame: Frame, *, late: bool) -> None:
        mark = self.marker.mark(frame, late=late)
        if mark is not None:
            for before in self.out.recordings.again():
                self.pipeline.push(*before)
            self.out.put(MarkedFrame(frame, mark))
            if mark & Mark.SKIPPED:
                self.intake.skipped += 1
                return
            self._take_frame(frame, mark)

    def _take_frame(self, frame: Frame, mark: Mark) -> None:
        intake = self.intake
        intake.standstill = None
        # the times in a replay are the recording's
        read, begun = intake.polled if self.marker.replay else frame.host_time, self._clock()
        self.latency.add_frame(frame, read, self.pipeline.tick_rate)
        try:
            with self.costs.of(frame):
                result = self.pipeline.push(frame, mark)
        except TomoskinError as error:  # of this frame: the source is well
            _leave_out(self, "frame", frame.host_time, error)
            return
        if result is None:
            return
        ready, decode = self._clock(), begun - read + intake.waited
        self.latency.add_result(decode, ready - begun)
        self.out.recordings.put(result)
        result = self.pipeline.early(result)
        self.newest = Snapshot(result, _truth(self, frame), decode + ready - begun, ready)
        self.out.tell(result)


def _tell_drive(flow: Flow, drive: DriveSamples, *, late: bool) -> None:
    """Tell where touches are by now, unless that is ``late``: of drives that wait the newest alone
    is told. Frames alone are recorded."""
    newest = flow.newest
    if newest is None or flow.marker.held:
        return
    try:
        known = flow.pipeline.push_drive(drive, late=late)
    except (TomoskinError, np.linalg.LinAlgError) as error:  # frames go on
        _leave_out(flow, "drive", drive.host_time, error)
        return
    for touch in () if known is None else known.withdrawn:
        text = f"touch {touch.id} is withdrawn: no whole scan has confirmed it"
        flow.out.tell(Event(drive.host_time, "touch-withdrawn", text))
    if known is None or not (known.touches or newest.result.touches):
        return
    result = replace(
        newest.result, host_time=known.host_time, scanned=known.scanned, scan_time=known.scan_time,
        touches=known.touches, events=(),
    )  # fmt: skip
    ready = flow.now()
    latency = ready - drive.host_time + flow.intake.waited
    flow.newest = Snapshot(result, flow.twin.truth, latency, ready)
    flow.out.tell(result)


def _leave_out(flow: Flow, what: str, host_time: float, error: Exception) -> None:
    flow.intake.skipped += 1
    refused = Event(host_time, "refused", f"a {what} was left out: {error}")
    for event in flow.intake.repeats.push(host_time, [refused]):
        flow.out.put(event)


def _dropped(flow: Flow) -> int:
    """Frames that the device or this host left out."""
    return flow.intake.losses.dropped + flow.intake.skipped + flow.pipeline.refused


def _board(flow: Flow) -> dict[str, object]:
    """How the board is doing now, by name; from any thread."""
    info, losses, newest = flow.board, flow.intake.losses, flow.newest
    health = newest.result.health if newest else None
    return {
        "board": info.unique_id.hex() if info else "",
        "board_name": flow.board_name,
        "firmware": ".".join(map(str, info.firmware)) if info else "",
        "frames_per_s": round(flow.latency.rate(flow.now()), 1),
        "dropped": _dropped(flow),
        "corrupt": losses.corrupt,
        "missing": losses.gaps,
        "late": losses.late,
        "deaf": losses.deaf,
        "electrodes": (health.text if health else None) or "good",
    }


def _truth(flow: Flow, frame: Frame) -> tuple[Probe, ...]:
    """What pressed when the frame was read."""
    replay = flow.marker.replay
    if replay is None:
        return flow.twin.truth
    number = bisect_right(replay.truth, frame.host_time, key=lambda truth: truth.host_time)
    presses = replay.truth[number - 1].presses if number else ()
    return tuple(chain.from_iterable(map(_recorded, presses)))


def _recorded(press: Mapping[str, Any]) -> Iterator[Press]:
    """A press of a recording; nothing where it describes none."""
    with suppress(KeyError, TypeError, ValueError, TomoskinError):
        yield Press(*(float(press[name]) for name in ("x", "y", "force", "radius")))


def _doubt(prepared: Prepared, reference: ReferenceState) -> str | None:
    """Whether the reference is this skin's, where positions rest on its model."""
    if any(c.kind.locates for c in prepared.calibrations.values()):
        return None
    return reference.agreement.doubt(volts=True)
