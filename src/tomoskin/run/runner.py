"""The running pipeline: a thread that owns the source, asked by commands from any other."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

from tomoskin.board.source import Transport
from tomoskin.core import Event, ModelError, OutputError, SourceError, StrPath, WireError
from tomoskin.files.messages import Place
from tomoskin.pipeline import Prepared
from tomoskin.run import commands
from tomoskin.run.flow import Flow, News, Snapshot
from tomoskin.run.intake import PAUSED, play
from tomoskin.run.loop import Loop
from tomoskin.run.publisher import Audience, Turns
from tomoskin.run.recordings import FILE_NAME
from tomoskin.run.sinks import Contacts, Sink
from tomoskin.run.status import Status


def do(flow: Flow, command: commands.DirectCommand) -> None:
    """Carry out what any thread may do.

    Raises
    ------
    WireError
        For what the source cannot do or does not have.
    GeometryError
        For a shape that its sheet cannot take.
    """
    match command:
        case commands.Note():
            newest = flow.newest
            host_time = newest.result.host_time if newest else flow.now()
            flow.out.put(Event(host_time, "note", command.text))
        case commands.SetTwin():
            if not flow.twin.breakable:
                raise WireError(f"{flow.source} cannot simulate faults")
            try:
                flow.twin.set_harm(command)
            except ModelError as error:
                raise WireError(str(error)) from None
        case commands.SetPose():
            if not flow.twin.bendable:
                raise WireError(f"{flow.source} cannot be bent on the page")
            flow.twin.set_pose(command, flow.prepared.skin.surface)
        case _:
            if flow.marker.replay is None:
                raise WireError(f"{flow.source} is not a replay")
            play(flow.marker.replay, command)


class Runner:
    """Feeds a pipeline from a source until it is stopped; may be used from any thread.

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
    robot
        Which of a robot's skins it is, and the turns that its runs share.
    early
        Whether drives tell of touches before their scan ends, where the board can.

    Attributes
    ----------
    audience
        Who is told of each result: see :meth:`~tomoskin.run.publisher.Audience.watch` and
        :meth:`~tomoskin.run.publisher.Audience.subscribe`; from any thread.
    events
        What happened, the newest kept.
    """

    def __init__(
        self,
        prepared: Prepared,
        open_transport: commands.Opener,
        *,
        clock: Callable[[], float] = time.monotonic,
        sinks: Sequence[Sink] = (),
        robot: tuple[Place, Turns] | None = None,
        early: bool = False,
    ) -> None:
        place, turns = robot or (None, None)
        self.audience = Audience(clock, tuple(sinks), place, turns, early=early)
        self.audience.obey = self.obey
        self.events = self.audience.events
        self._loop = Loop(prepared, open_transport, self.audience)
        self._thread: threading.Thread | None = None

    def start(self, *, patient: bool = False) -> SourceError | None:
        """Open the source and begin.

        Where ``patient``, begin without it too, and go on trying to open it: one of several
        boards may be missing. Sinks are given why as they are given the loss of a board, and it
        is returned.

        Raises
        ------
        SourceError
            When the source cannot be opened the first time: better said at once than retried.
        """
        transport: Transport | None = None
        missing: SourceError | None = None
        try:
            transport = self._loop.open()
            self._loop.flow.begin(transport)
        except SourceError as error:
            if not patient:
                raise
            missing = error
            out, prepared = self._loop.flow.out, self._loop.flow.prepared
            out.begin(prepared, prepared.skin.name)
            why = f"the source cannot be opened, and tomoskin tries again: {error}"
            out.say("source-lost", why)
        self._loop.commands.begin()
        self._thread = threading.Thread(
            target=self._loop.run, args=(transport,), name="tomoskin-runner", daemon=True
        )
        self._thread.start()
        return missing

    def stop(self) -> None:
        """Stop the device and end; returns when it is done. A second call does nothing."""
        self._loop.stop()
        if self._thread is not None:
            self._thread.join()
        self._loop.flow.out.stop()

    def submit(self, command: commands.Command) -> Future[None]:
        """Have ``command`` carried out soon; the future says when, or what is wrong with it.

        A :data:`~tomoskin.run.commands.DirectCommand` is carried out before this returns.
        """
        if not isinstance(command, commands.DirectCommand):
            return self._loop.commands.put(command)
        future: Future[None] = Future()
        try:
            do(self._loop.flow, command)
        except Exception as error:  # it is for whoever takes the result
            future.set_exception(error)
        else:
            future.set_result(None)
        return future

    def ask(self, command: commands.Command) -> None:
        """Have ``command`` carried out, and return when it is; from any thread but the run's own.

        Raises
        ------
        TomoskinError
            What is wrong with it, as the command's own description says.
        """
        self.submit(command).result()

    def obey(self, request: str, folder: StrPath) -> str:
        """Do what a listener asks for by name, a recording in ``folder``; what was done.

        Raises
        ------
        TomoskinError
            What is wrong with it.
        """
        out = self._loop.flow.out
        file = out.recordings.path
        match request:
            case "reference":
                self.ask(commands.TakeReference())
                return "the next frames are the reference: do not touch the skin"
            case "record":
                if file is not None:
                    raise OutputError("is being recorded to", where=str(file), hint="stop it first")
                file = out.stream.file(Path(folder) / time.strftime(FILE_NAME))
                self.ask(commands.Record(file))
                return f"recording to {file}"
            case "stop":
                self.ask(commands.StopRecording())
                return f"{file} is complete" if file else "nothing was being recorded"
        raise WireError(f'expected "reference", "record" or "stop", got "{request}"')

    def say(self, kind: str, text: str) -> None:
        """Publish an event of this moment."""
        self._loop.flow.out.say(kind, text)

    def status(self) -> Status:
        """The status of the run at this moment."""
        return self._loop.flow.status(self._loop.trouble)

    @property
    def flow(self) -> Flow:
        """The skin and source of this moment, and what becomes of their frames."""
        return self._loop.flow

    @property
    def prepared(self) -> Prepared:
        """The prepared skin of this moment."""
        return self._loop.flow.prepared

    @property
    def newest(self) -> Snapshot | None:
        """The newest result, or None before the first."""
        return self._loop.flow.newest

    @property
    def contacts(self) -> Contacts:
        """The newest result as it leaves the program; not valid while no frames come."""
        return self.contacts_of(self.news)

    @property
    def news(self) -> News:
        """What :meth:`contacts_of` makes contacts of, at no cost: another pair is other news."""
        flow = self._loop.flow
        trouble = self._loop.trouble or flow.intake.standstill
        return flow.newest, trouble or (PAUSED if flow.marker.held else None)

    def contacts_of(self, news: News) -> Contacts:
        """The contacts of a result that :attr:`news` gave."""
        return self._loop.flow.contacts(news)
