"""The runner's thread: reads the source, opens it again when it is lost, goes over to another."""

from __future__ import annotations

import gc
import logging
import sys
import threading
import time
from concurrent.futures import Future
from contextlib import suppress

from threadpoolctl import threadpool_limits

from tomoskin.board.source import Transport
from tomoskin.core import SourceError, TomoskinError, watch_stages
from tomoskin.pipeline import Prepared
from tomoskin.run import commands
from tomoskin.run.commands import Opener, RunCommands
from tomoskin.run.flow import Flow
from tomoskin.run.intake import PAUSED
from tomoskin.run.publisher import Audience

_POLL = 0.05
_WAITING = "waiting for the board to answer"
_WARMING = "preparing to fit touches; for a new skin this takes some seconds"
_FIRST_DELAY, _LONGEST_DELAY = 0.25, 5.0

_TURN = 5e-4
"""Seconds after which a thread of Python lets another one go on that waits; it is 5 ms by itself,
two frames of a quick board."""

_log = logging.getLogger(__name__)


class _Interpreter:
    """A context manager under which Python holds up no frame for long, while any run lasts.

    Threads take turns often. What is there once a run is prepared is no garbage, so the collector
    leaves it alone: to look through it took 50 ms, at some moment while touches were followed.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._runs, self._turn = 0, _TURN

    def __enter__(self) -> None:
        with self._lock:
            if not self._runs:
                self._turn = sys.getswitchinterval()
                sys.setswitchinterval(min(_TURN, self._turn))
            self._runs += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._runs -= 1
            if not self._runs:
                sys.setswitchinterval(self._turn)
                gc.unfreeze()

    def settle(self) -> None:
        """Collect what has become garbage since this was done last, and keep the rest.

        All that there is would take a tenth of a second with several skins, and boards that scan
        already lose frames meanwhile.
        """
        with self._lock:
            gc.collect()
            gc.freeze()


_INTERPRETER = _Interpreter()


class _StoppedError(Exception):
    """The run has to end, and its loop is left by this."""


class Loop:
    """Follows one source after the other until it is stopped, and carries out what is asked.

    Attributes
    ----------
    flow
        The skin and source of the moment; another one after each change.
    open
        What opens its source.
    trouble
        Why no frames come, or None.
    commands
        What it is asked.
    """

    def __init__(self, prepared: Prepared, opener: Opener, audience: Audience) -> None:
        self.flow, self.open = Flow(prepared, audience), opener
        self.trouble: str | None = "not started"
        self.commands = RunCommands(self._handle)
        self._audience = audience
        self._change: tuple[commands.Change, Future[None]] | None = None
        self._stopping = False

    def stop(self) -> None:
        """Let :meth:`run` end soon; from any thread."""
        self._stopping = True
        self.commands.nudge()

    def run(self, transport: Transport | None) -> None:
        """Follow ``transport``, and what comes after it; returns at the end.

        None: it could not be opened yet.
        """
        try:
            # a frame's products are small: more threads would only wait for each other
            with threadpool_limits(1), _INTERPRETER:
                self._warm_up()
                _INTERPRETER.settle()
                self.trouble = _WAITING
                transport = transport or self._next()
                while transport is not None:
                    self._follow(transport)
                    transport = self._next()
        except Exception as error:
            _log.exception("the live thread ended")
            self.trouble = f"internal error, {type(error).__name__}: {error}; start tomoskin again"
            self.flow.out.say("internal", self.trouble)
        finally:
            self._refuse("the run has ended")
            self.commands.end()

    def _warm_up(self) -> None:
        """Do what would hold up the first frames, unless it is to stop."""

        def watch(_stage: str) -> None:
            if self._stopping:
                raise _StoppedError

        self.trouble = _WARMING
        with suppress(_StoppedError), watch_stages(watch):
            self.flow.prepared.warm_up()

    def _follow(self, transport: Transport) -> None:
        """Take frames until the source is lost or to be left."""
        flow = self.flow
        try:
            with flow.link(transport) as link:
                while True:
                    self.commands.carry_out()
                    if self._stopping or self._change is not None:
                        break
                    flow.press()
                    items = link.poll(_POLL)
                    if link.running:
                        self.trouble = None
                    elif link.diagnosis is not None:
                        self._report("no-answer", str(link.diagnosis))
                    flow.take(link, items)
        except TomoskinError as error:
            self._report("source-lost", str(error))
        finally:
            flow.intake.close()  # another session may follow

    def _report(self, kind: str, trouble: str) -> None:
        """Say why no frames come, unless that is known already."""
        if trouble != self.trouble:
            self.trouble = trouble
            self.flow.out.say(kind, trouble)

    def _next(self) -> Transport | None:
        """What is followed next: what was changed to, else the old one again; None at the end."""
        delay, due = _FIRST_DELAY, time.monotonic() + _FIRST_DELAY
        while not self._stopping:
            self.commands.carry_out()
            if (transport := self._change_over()) is not None:
                return transport
            if self.commands.wait(due - time.monotonic()):
                continue
            try:
                transport = self.open()
            except TomoskinError as error:
                self.trouble = str(error)
                delay = min(2 * delay, _LONGEST_DELAY)
                due = time.monotonic() + delay
            else:
                if not self.flow.source:
                    self.flow.begin(transport)
                return transport
        return None

    def _handle(self, command: commands.QueuedCommand) -> Future[None] | None:
        """Carry out a command; what it returns is done when the command is."""
        flow = self.flow
        match command:
            case commands.TakeReference():
                flow.marker.reference = True
            case commands.SetPause():
                if command.on and not flow.marker.held:
                    flow.out.say("paused", PAUSED)
                flow.marker.hold(command.on)
            case commands.HoldPresses():
                flow.twin.hold(command.owner, command.presses)
            case commands.Record():
                return flow.out.recordings.begin(command.path, command.log, command.frames)
            case commands.StopRecording():
                return flow.out.recordings.end()
            case commands.Adopt():
                return flow.adopt(command.prepared)
            case commands.Change():
                return self._ask_change(command)
        return None

    def _ask_change(self, change: commands.Change) -> Future[None]:
        if not self.commands.taken:
            raise SourceError("the run has ended")
        self._refuse("it was replaced by a newer choice")
        future: Future[None] = Future()
        self._change = change, future
        return future

    def _refuse(self, why: str) -> None:
        """The change that waits, if any, is not to be."""
        change, self._change = self._change, None
        if change is not None:
            change[1].set_exception(SourceError(why))

    def _change_over(self) -> Transport | None:
        """Change to what was asked, if anything was; None where it cannot be opened."""
        if self._change is None:
            return None
        (change, future), self._change = self._change, None
        opener = change.open or self.open
        try:
            transport = opener()
        except TomoskinError as error:
            future.set_exception(error)
            return None
        self.flow.out.stop()
        self.flow, self.open = Flow(change.prepared, self._audience), opener
        self.flow.begin(transport)
        gc.unfreeze()  # the old skin may go
        _INTERPRETER.settle()
        self.trouble = _WAITING
        future.set_result(None)
        return transport
