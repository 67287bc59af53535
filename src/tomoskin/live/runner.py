"""The running pipeline: a thread that owns the source and keeps only the newest result."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from threadpoolctl import threadpool_limits

from tomoskin.core import DataError, Event, Frame, SourceError, TomoskinError
from tomoskin.live.events import EventLog, told
from tomoskin.live.meter import Meter
from tomoskin.live.pipeline import Pipeline
from tomoskin.live.play import where_is
from tomoskin.live.prepare import Prepared, same_body
from tomoskin.live.presses import Breakable, Harm, Pressable, PressBoard
from tomoskin.live.published import moment_of, stream_of
from tomoskin.live.replayed import advance
from tomoskin.live.result import Result
from tomoskin.live.status import Status
from tomoskin.live.tally import Tally
from tomoskin.live.tape import Tape
from tomoskin.live.wishes import Replayed, Wishes
from tomoskin.session import Mark
from tomoskin.signal import Reference
from tomoskin.sink import Outlets, Sink
from tomoskin.source import Link, ScanSettings, Transport
from tomoskin.twin import Press
from tomoskin.wire import Info

MOST_AT_ONCE = 16
"""Where more frames than this wait, the oldest are skipped: a late picture helps nobody."""

_POLL = 0.05
_STANDSTILL = frozenset({"silent", "fault", "reset"})
"""Events after which no frame comes until the board is well again."""

_WAITING = "waiting for the board to answer"
_ADOPTION = 1.0
_FIRST_DELAY, _LONGEST_DELAY = 0.25, 5.0

_log = logging.getLogger(__name__)


@dataclass(slots=True, eq=False)
class _Change:
    """Another skin or source, wanted by another thread."""

    prepared: Prepared
    open: Callable[[], Transport]
    done: threading.Event = field(default_factory=threading.Event)
    error: TomoskinError | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A result, the presses on the twin when it was read, and its latency in s."""

    result: Result
    truth: tuple[Press, ...]
    latency: float


class Runner:
    """Feeds a pipeline from a source until it is stopped.

    A source that is lost is opened again, after a pause that doubles up to 5 s; the reference
    stands meanwhile. Readers take :attr:`newest` whenever they like; a slow one delays nobody.

    Parameters
    ----------
    prepared
        What was made once for the skin.
    open_transport
        Opens the source; called again after a loss.
    clock
        Host monotonic seconds, the same as in ``Frame.host_time``.
    sinks
        Where results go, beside those who take :attr:`newest`; a slow one delays nobody.

    Attributes
    ----------
    newest
        The newest result, or None before the first.
    events
        What happened, the newest kept.
    source
        Source and skin in words, once it has been opened.
    pressable
        Whether the source can be pressed from a page, as the twin can.
    harmed
        What is wrong with the source by our doing.
    """

    def __init__(
        self,
        prepared: Prepared,
        open_transport: Callable[[], Transport],
        *,
        clock: Callable[[], float] = time.monotonic,
        sinks: Sequence[Sink] = (),
    ) -> None:
        self.prepared = prepared
        self.newest: Snapshot | None = None
        self.events = EventLog()
        self.source = ""
        self.pressable = False
        self._open = open_transport
        self._clock = clock
        self._settings = ScanSettings.of(prepared.skin)
        self._pipeline = Pipeline(prepared)
        self._meter = Meter()
        self._presses = PressBoard()
        self._truth: tuple[Press, ...] = ()
        self._pressed, self._polled = 0, 0.0
        self._wishes = Wishes()
        self._tape = Tape(prepared, self.say, clock, self._numbered)
        self._sinks = tuple(sinks)
        self._outlets = Outlets(sinks, self.say)
        self._tally, self._earlier, self._skipped = Tally(), Tally(), 0
        self._trouble: str | None = "not started"
        self._standstill: str | None = None
        self._watchers: list[Callable[[], None]] = []
        self._watching = threading.Lock()
        self._stopping = threading.Event()
        self._nudge = threading.Event()
        self._change: _Change | None = None
        self._adopted: tuple[Prepared, threading.Event] | None = None
        self._broken: Breakable | None = None
        self.harmed = Harm()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Open the source and begin.

        Raises
        ------
        SourceError
            When the source cannot be opened the first time: better said at once than retried.
        """
        transport = self._open()
        self._settle(transport)
        self._thread = threading.Thread(
            target=self._run, args=(transport,), name="tomoskin-runner", daemon=True
        )
        self._thread.start()

    def stop(self) -> None:
        """Stop the device and end; returns when it is done. A second call does nothing."""
        self._stopping.set()
        self._nudge.set()
        if self._thread is not None:
            self._thread.join()
        self._outlets.stop()
        self._tape.stop()

    def change(self, prepared: Prepared, open_transport: Callable[[], Transport]) -> None:
        """Go on with another skin or source; returns when it does, from any thread but its own.

        A recording ends, and the reference is taken anew. The old source is closed before the
        new one is opened, since both may be the same port.

        Raises
        ------
        SourceError
            When the new one cannot be opened (or any error of its kind): the old one goes on.
        """
        change = _Change(prepared, open_transport)
        before, self._change = self._change, change
        self._nudge.set()
        if before is not None:
            before.error = SourceError("something else has been chosen meanwhile")
            before.done.set()
        while not change.done.wait(_POLL):
            if self._thread is None or not self._thread.is_alive():
                raise SourceError("it is not running")
        if change.error is not None:
            raise change.error

    def adopt(self, prepared: Prepared) -> None:
        """Go on with other settings of the same mesh and scan, from the next read on.

        The reference stands; a recording ends. Nothing is done where the skin has been changed
        meanwhile (:meth:`change`). Returns when it is done, or a second later where no source
        is there to go on with; from any thread but its own.
        """
        done = threading.Event()
        self._adopted = prepared, done
        done.wait(_ADOPTION)

    @property
    def breakable(self) -> bool:
        """Whether the source can be broken and mended, as the twin can."""
        return self._broken is not None

    def harm(self, harm: Harm) -> None:
        """Break and mend the source, from any thread; ModelError for what it does not have."""
        if self._broken is not None:
            harm.do(self._broken)
            self.harmed = harm

    @property
    def reference(self) -> Reference | None:
        """What the untouched skin reads; None until that is known."""
        return self._pipeline.reference

    def record(self, path: Path) -> None:
        """Record from now on, beside the pipeline: raw bytes, frames, touches and the rest.

        Raises
        ------
        DataError
            When the file exists or cannot be made. What goes wrong later is an event.
        """
        self._tape.record(path)

    def stop_recording(self) -> None:
        """End the recording, if there is one; returns when the file is whole."""
        self._tape.stop()

    def take_reference(self) -> None:
        """The next frames become the reference."""
        self._wishes.take_reference()

    def pause(self, on: bool) -> None:
        """Hold the picture, or let it go on; frames are read and left out meanwhile."""
        self._wishes.hold(on)

    @property
    def replay(self) -> Replayed | None:
        """The recording that is being played; None where the source is another."""
        return self._wishes.replay

    @property
    def board(self) -> Info | None:
        """What the board said of itself, once it has."""
        return self._tape.info

    @property
    def opening(self) -> Callable[[], Transport]:
        """What opens the source."""
        return self._open

    def note(self, text: str) -> None:
        """A person's remark on the picture of this moment; goes into the recording as well."""
        newest = self.newest
        event = Event(newest.result.host_time if newest else self._clock(), "note", text)
        self.events.add(event)
        self._tape.note(event)
        self._outlets.put(event)

    def set_presses(self, owner: object, presses: tuple[Press, ...]) -> None:
        """All presses that ``owner`` holds now; an empty tuple lifts them."""
        self._presses.put(owner, presses)

    def say(self, kind: str, text: str) -> None:
        """Publish an event of this moment."""
        self._publish(Event(self._clock(), kind, text))

    @contextlib.contextmanager
    def watched_by(self, announce: Callable[[], None]) -> Iterator[None]:
        """While the block lasts, call ``announce`` from the runner's thread at each result.

        It must return at once. After the block it is not called again.
        """
        with self._watching:
            self._watchers.append(announce)
        try:
            yield
        finally:
            with self._watching:
                self._watchers.remove(announce)

    def status(self) -> Status:
        """How it is doing now."""
        now = self._clock()
        p50, p99 = self._meter.latency()
        reference = self._pipeline.reference_state
        result = self.newest.result if self.newest else None
        total = self._earlier + self._tally
        return Status(
            source=self.source,
            running=self._trouble is None and self._standstill is None,
            paused=self._wishes.held,
            recording=self._tape.path,
            sinks=self._outlets.reports(),
            replay=where_is(self.replay) if self.replay else None,
            frames=self._meter.frames,
            fps=self._meter.rate(now),
            dropped=total.dropped + self._skipped + self._pipeline.refused,
            corrupt=total.corrupt,
            gaps=total.gaps,
            p50=p50,
            p99=p99,
            reference=reference,
            reference_age=None if reference.since is None else self._here() - reference.since,
            choice=self._pipeline.choice,
            left_out=result.left_out if result else 0,
            electrodes=result.health.sick if result and result.health else (),
            problem=self._trouble or self._standstill or (result.problem if result else None),
        )

    def _here(self) -> float:
        """Host time of now, of a replay that of the recording."""
        return self.replay.now() if self.replay else self._clock()

    def _run(self, transport: Transport | None) -> None:
        try:
            # a frame's products are small: more threads would only wait for each other
            with threadpool_limits(1):
                while transport is not None:
                    self._follow(transport)
                    transport = self._following()
        except Exception as error:
            _log.exception("the live thread ended")
            self._trouble = f"internal error, {type(error).__name__}: {error}; start again"
            self.say("internal", self._trouble)

    def _follow(self, transport: Transport) -> None:
        """Take frames until the source is lost or the runner is stopped."""
        self._trouble, self._standstill = _WAITING, None
        self._pressed = -1
        drops = 0
        try:
            with self._link(transport) as link:
                while not self._stopping.is_set() and self._change is None:
                    self._take_over()
                    self._press(transport)
                    found = link.poll(_POLL)
                    self._polled = self._clock()
                    self._trouble = None if link.running else _WAITING
                    self._tape.linked(link)
                    if link.info is not None and link.info.tick_rate:
                        self._pipeline.tick_rate = link.info.tick_rate
                    frames = [item for item in found if isinstance(item, Frame)]
                    drops = frames[-1].drops if frames else drops
                    self._tally = Tally.of(link, drops)
                    self._note([item for item in found if isinstance(item, Event)])
                    self._take(frames)
        except TomoskinError as error:
            self._trouble = str(error)
            self.say("source-lost", str(error))
        finally:
            self._earlier, self._tally = self._earlier + self._tally, Tally()

    def _numbered(self) -> int:
        return self._pipeline.numbered

    def _link(self, transport: Transport) -> Link:
        self._broken = transport if isinstance(transport, Breakable) else None
        self.harm(self.harmed)
        self._wishes.opened(transport)
        if self.replay:
            self._pipeline.number_after(self.replay.touches_before)
        clock, tap = self._clock, self._tape.read
        return Link(transport, self.prepared.scan, self._settings, clock=clock, tap=tap)

    def _publish(self, event: Event) -> None:
        self.events.add(event)
        self._tape.event(event)
        self._outlets.put(event)

    def _following(self) -> Transport | None:
        """What is followed next: what was changed to, else the old one anew; None at the end."""
        delay = _FIRST_DELAY
        while not self._stopping.is_set():
            if (transport := self._changed()) is not None:
                return transport
            if self._nudge.wait(delay):
                self._nudge.clear()
                continue
            try:
                return self._open()
            except TomoskinError as error:
                self._trouble = str(error)
                delay = min(2 * delay, _LONGEST_DELAY)
        return None

    def _changed(self) -> Transport | None:
        """Change to what is wanted, if anything is; None where it cannot be opened."""
        change, self._change = self._change, None
        if change is None:
            return None
        try:
            transport = change.open()
        except TomoskinError as error:
            change.error = error
            change.done.set()
            return None
        self._become(change.prepared, change.open)
        self._settle(transport)
        change.done.set()
        return transport

    def _become(self, prepared: Prepared, open_transport: Callable[[], Transport]) -> None:
        """Another skin and source, with nothing left of the ones before but the events."""
        self._tape.stop()
        self._outlets.stop()
        self.prepared, self._open = prepared, open_transport
        self._settings = ScanSettings.of(prepared.skin)
        self._pipeline, self._meter, self._wishes = Pipeline(prepared), Meter(), Wishes()
        self._tally, self._earlier, self._skipped = Tally(), Tally(), 0
        self._tape = Tape(prepared, self.say, self._clock, self._numbered)
        self._outlets = Outlets(self._sinks, self.say)
        self._presses, self._truth, self.harmed = PressBoard(), (), Harm()
        self.newest = None

    def _take_over(self) -> None:
        """Adopt what has been prepared, if anything has."""
        adopted, self._adopted = self._adopted, None
        if adopted is None:
            return
        prepared, done = adopted
        if same_body(prepared.skin, self.prepared.skin):
            self._tape.adopt(prepared)
            self.prepared = prepared
            self._pipeline.adopt(prepared)
        done.set()

    def _settle(self, transport: Transport) -> None:
        """A source has been opened; say what it is."""
        self.pressable = isinstance(transport, Pressable)
        self._wishes.opened(transport)
        skin, name = self.prepared.skin.name, transport.name
        self.source = f"{name} of {skin}" if self.pressable else f"{skin} on {name}"
        self._tape.opened(self.source)
        self._outlets.start(stream_of(self.prepared, self.source))

    def _press(self, transport: Transport) -> None:
        changes, presses = self._presses.all()
        if changes != self._pressed and isinstance(transport, Pressable):
            transport.set_presses(presses)
            self._pressed, self._truth = changes, presses
            self._tape.truth(presses)

    def _note(self, happened: list[Event]) -> None:
        for event in happened:
            self._publish(event)
            if event.kind in _STANDSTILL:
                self._standstill = event.text

    def _take(self, frames: list[Frame]) -> None:
        late = len(frames) - MOST_AT_ONCE
        for number, frame in enumerate(frames):
            mark = self._wishes.mark(frame, late=number < late)
            if mark is not None:
                for before in self._tape.again():
                    advance(self._pipeline, *before)
                self._tape.frame(frame, mark)
                self._process(frame, mark)

    def _read(self, frame: Frame) -> float:
        """When its last byte was read, by our clock; the times in a replay are the recording's."""
        return self._polled if self.replay else frame.host_time

    def _process(self, frame: Frame, mark: Mark) -> None:
        if mark & Mark.SKIPPED:
            self._skipped += 1
            return
        self._standstill = None
        self._meter.arrived(self._read(frame))
        try:
            result = advance(self._pipeline, frame, mark)
        except DataError as error:
            self._skipped += 1
            self.say("refused", f"a frame was left out: {error}")
            return
        if result is None:
            return
        latency = self._clock() - self._read(frame)
        self._meter.took(latency)
        self.newest = Snapshot(result, self._truth, latency)
        self._tape.result(result)
        for happened in result.events:
            self._tape.event(told(happened))
        if self._outlets:
            self._outlets.put(moment_of(result))
        with self._watching:
            for announce in self._watchers:
                announce()
