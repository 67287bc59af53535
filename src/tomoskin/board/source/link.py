"""A board behind a transport: the protocol session with it, and the frames that come of it."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from contextlib import AbstractContextManager

from tomoskin.board.source.agreement import Rated, RateFollower
from tomoskin.board.source.clock import ClockWatch
from tomoskin.board.source.protocol_session import ProtocolSession, Received, Stage
from tomoskin.board.source.settings import ScanSettings, Timing
from tomoskin.board.source.transport import Diagnosable, Played, Transport
from tomoskin.board.wire import Ack, Decoder, Info, Stop
from tomoskin.core import Frame, SourceError
from tomoskin.model.pattern import Scan

_HEARD = 256
"""So many of the first bytes tell what speaks where no board does."""


class Link(AbstractContextManager["Link"]):
    """Sets a board up for a scan and passes its frames on.

    Everything happens in :meth:`poll`; leaving the ``with`` block, or :meth:`close`, stops the
    board.

    Attributes
    ----------
    session
        The protocol session: what it says of the board, and of the scan as the board does it.
    diagnosis
        Why no board answers, once it should have; None where it does, or nobody can tell.
    counters, frames
        What the stream has held until now: messages and dropped bytes; frames passed, lost, foreign
        and stale.
    """

    def __init__(
        self,
        transport: Transport,
        scan: Scan,
        settings: ScanSettings,
        *,
        timing: Timing | None = None,
        clock: Callable[[], float] = time.monotonic,
        tap: Callable[[float, bytes], None] | None = None,
    ) -> None:
        """A link that has not spoken yet.

        ``clock`` gives monotonic seconds; a transport that plays a recording brings its own.
        ``tap`` is called with the host time and bytes of every read, before they are decoded.
        """
        self.transport = transport
        self._played = transport if isinstance(transport, Played) else None
        self._clock = self._played.now if self._played else clock
        self._tap = tap
        self._timing = timing or Timing()
        self._decoder = Decoder()
        self._rate = RateFollower(transport) if isinstance(transport, Rated) else None
        self.session = ProtocolSession(scan, settings, self._timing, self._clock(), transport.name)
        self.counters, self.frames = self._decoder.counters, self.session.frames.counters
        self._watch = ClockWatch()
        self._closed = False
        self._heard = b""
        self.diagnosis: SourceError | None = None

    @property
    def running(self) -> bool:
        """Whether the board scans for this link."""
        return self.session.stage is Stage.RUNNING

    @property
    def waited(self) -> float:
        """How long the first byte of the last read had waited on this host, s."""
        waited: float = getattr(self.transport, "waited", 0.0)
        return waited

    def poll(self, timeout: float) -> list[Received]:
        """Frames, drives sent singly, and events, waiting at most ``timeout`` s for bytes.

        Raises
        ------
        SourceError
            The device has gone away, does not answer, or cannot do this scan.
        WireError
            The device speaks another protocol.
        """
        now = self._clock()
        try:
            items = self.session.tick(now)
        except SourceError as error:
            raise self.diagnosis or error from None
        if self.counters.messages:
            self.diagnosis = None
        elif (
            self.diagnosis is None
            and self.session.stage is Stage.SETTING_UP
            and isinstance(self.transport, Diagnosable)
        ):
            self.diagnosis = self.transport.diagnose(self._heard)
        self._flush()
        patience = min(timeout, self.session.deadline() - now)
        items += self._listen(max(patience, 0.0))
        return items

    def keep_alive(self) -> None:
        """Let the board know that the host is there, while :meth:`poll` is not called for long."""
        if self.running:
            self.session.commands.keep_alive(self._clock())
        with contextlib.suppress(SourceError):  # gone: the next poll says so
            self._flush()

    def connect(self) -> Info:
        """Poll until the board scans; what it said of itself. Raises as :meth:`poll` does."""
        while not self.running:
            self.poll(self._timing.answer)
        assert self.session.info is not None
        return self.session.info

    def close(self) -> None:
        """Stop the board, as far as it can still be reached, and give the transport back."""
        if self._closed:
            return
        try:
            self.stop()
        finally:
            self._closed = True
            self.transport.close()

    def stop(self) -> None:
        """Stop the board, as far as it can still be reached; the transport stays open."""
        with contextlib.suppress(SourceError):  # gone already: its heartbeat stops it
            self.session.frames.close()
            self.session.commands.clear()
            request = self.session.commands.send(Stop(0), self._clock())
            self._flush()
            end = self._clock() + self._timing.goodbye
            while (now := self._clock()) < end:
                for message in self._decoder.feed(self.transport.read(end - now), now):
                    if isinstance(message, Ack) and message.request == request:
                        return

    def __exit__(self, *_: object) -> None:
        """Close the link, whatever ended the block."""
        self.close()

    def _listen(self, timeout: float) -> list[Received]:
        data = self.transport.read(timeout)
        now = self._clock()
        if data and self._tap:
            self._tap(now, data)
        if not self.counters.messages:
            self._heard = (self._heard + data)[:_HEARD]
        if data and self._played and self._played.after_seek():
            self._decoder.forget()
            self.session.frames.expect_any()
            self.session.drives.forget()
        items = []
        for message in self._decoder.feed(data, now):
            items += self.session.receive(message, now)
        if (info := self.session.info) is not None:
            frames = [item for item in items if isinstance(item, Frame)]
            doubts = [self._watch.push(frame, info.tick_rate) for frame in frames]
            items += filter(None, doubts)
        if self._rate:
            self._rate.follow(self.session.commands.take_rate(), silent=self.session.is_silent)
            slower = self._rate.slower(self.counters, running=self.running)
            items += [] if slower is None else [self.session.fall_back(slower, now)]
        self._flush()
        return items

    def _flush(self) -> None:
        data = self.session.commands.take()
        if data:
            self.transport.write(data)
