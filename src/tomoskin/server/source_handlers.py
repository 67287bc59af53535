"""Requests about sources and files: what can be connected, what the board is; what is in the
session folder, a session as replay, exports of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from tomoskin.board.source import BOARDS, DEFAULT_BOARD, list_ports, open_source
from tomoskin.board.wire import SCHEMA, Info
from tomoskin.core import DataError, SourceError, WireError
from tomoskin.files.exports import WRITERS, Export, export_touches
from tomoskin.files.session import ReplayTransport, SessionReader, as_recorded, parse_replay
from tomoskin.pipeline import Prepared
from tomoskin.run import Runner, commands
from tomoskin.server import requests
from tomoskin.server.folder import SESSION
from tomoskin.server.hub import Hub
from tomoskin.server.page_connection import Page
from tomoskin.server.page_messages import BoardNow, Exported, FileEntry, Files, Offer, Sources

EMULATED = {
    "emulator"
    if name == DEFAULT_BOARD
    else f"emulator:{name}": f"Real firmware on a simulated {board.text}"
    for name, board in BOARDS.items()
    if board.emulator
}


@dataclass(frozen=True, slots=True)
class _Live:
    spec: str
    prepared: Prepared


class SourceSwitch:
    """Changes the runner's source; everything but :attr:`spec` belongs in a thread.

    Parameters
    ----------
    hub
        Whose runner; :meth:`Hub.show` is the caller's to call.
    spec
        The source at the start.
    """

    def __init__(self, hub: Hub, spec: str) -> None:
        self._hub = hub
        self._home = spec
        name, _, argument = spec.partition(":")
        self.spec = f"replay:{parse_replay(argument)[0].name}" if name == "replay" else spec
        """The source of the moment; a recording by the name of its file."""
        self._live: _Live | None = None

    def offers(self) -> list[Offer]:
        """What may be connected: the first source, the twin, the emulator, the ports here."""
        offers = {"twin": "Simulated skin (twin)", **EMULATED}
        offers |= {f"serial:{port.device}": str(port) for port in list_ports()}
        if not self._home.startswith("replay:"):
            offers = {self._home: offers.get(self._home, self._home)} | offers
        return [Offer(id=id, text=text) for id, text in offers.items()]

    def connect(self, spec: str) -> None:
        """Go on with one of :meth:`offers`. Raises SourceError."""
        if spec not in {offer.id for offer in self.offers()}:
            raise SourceError("expected one of the listed sources, got another", where=spec[:80])
        prepared = self._live.prepared if self._live else self._hub.runner.prepared
        self._go(_Live(spec, prepared))

    def play(self, path: Path) -> None:
        """Play a recording with its own skin. Raises DataError, SourceError."""
        runner = self._hub.runner
        with SessionReader(path) as session:
            prepared = as_recorded(session, runner.prepared)
        live = self._live or _Live(self.spec, runner.prepared)
        runner.ask(
            commands.Change(prepared, lambda: ReplayTransport(SessionReader(path), prepared.skin))
        )
        self._live, self.spec, self._hub.opener = live, f"replay:{path.name}", None

    def back(self) -> None:
        """From a recording to the source before it. Raises SourceError."""
        if self._live is None:
            raise SourceError("no recording is being played")
        if self._live.spec.startswith("replay:"):
            raise SourceError("there is no live source to go back to: connect one")
        self._go(self._live)

    def _go(self, live: _Live) -> None:
        opener = partial(open_source, live.spec, live.prepared.skin)
        self._hub.runner.ask(commands.Change(live.prepared, opener))
        self._live, self.spec = None, live.spec
        self._hub.opener = partial(open_source, live.spec)


def _identity(info: Info, name: str) -> BoardNow:
    return BoardNow.of(
        info,
        name=name,
        firmware=".".join(map(str, info.firmware)),
        protocol=f"{info.major}.{info.minor}",
        current_ma=info.current / 1e3,
        unique_id=info.unique_id.hex(),
    )


_T = TypeVar("_T")

_EVERY = 0.1
"""Seconds between two images of a picture or film."""


class SessionUse:
    """What each session of the folder is in use for."""

    def __init__(self, runner: Runner) -> None:
        self._runner = runner
        self.exporting: str | None = None
        self.share = 0.0

    @property
    def playing(self) -> str | None:
        """Name of the session that is being played."""
        replay = self._runner.flow.marker.replay
        return replay.path.name if replay is not None else None

    @property
    def recording(self) -> str | None:
        """Name of the session that is being recorded."""
        path = self._runner.flow.out.recordings.path
        return path.name if path is not None else None

    def check_ended(self, name: str) -> None:
        """Raise DataError where the session is still being recorded."""
        if name == self.recording:
            raise DataError("is still being recorded: end the recording first", where=name)

    def check_idle(self, name: str) -> None:
        """Raise DataError where the session is in use."""
        self.check_ended(name)
        if name == self.playing:
            raise DataError("is playing: go back to live first", where=name)
        if name == self.exporting:
            raise DataError("is being exported: wait until it has ended", where=name)


class SourceHandlers:
    """Answers about files of one folder by their names, one export at a time; and connects the
    sources of a list, no others: a page gives no path and no address."""

    def __init__(self, hub: Hub, switch: SourceSwitch) -> None:
        self._hub, self._switch = hub, switch
        self._use = SessionUse(hub.runner)
        hub.serve(
            {
                requests.ListSources: self._list_sources,
                requests.Connect: lambda page, ask: self._go(
                    page, partial(switch.connect, ask.source)
                ),
                requests.OpenSession: lambda page, ask: self._go(
                    page, partial(self._play, ask.name)
                ),
                requests.GoLive: lambda page, _: self._go(page, switch.back),
                requests.ListFiles: lambda page, _: self._list(page),
                requests.ExportSession: self._export,
                requests.RenameSession: self._rename,
                requests.DeleteSession: self._delete,
                requests.Annotate: self._annotate,
            }
        )

    def _list(self, page: Page) -> None:
        def answer(listed: tuple[tuple[FileEntry, ...], int]) -> None:
            files, others = listed
            page.post(Files.of(self._use, files=files, others=others).json)

        self._hub.tasks.run(page, self._hub.folder.list_files, answer)

    def _rename(self, page: Page, request: requests.RenameSession) -> None:
        def work() -> str:
            self._use.check_idle(request.name)
            return self._hub.folder.rename(request.name, request.to)

        self._change(page, work, lambda new: f"{request.name} is now {new}")

    def _delete(self, page: Page, request: requests.DeleteSession) -> None:
        def work() -> None:
            self._use.check_idle(request.name)
            self._hub.folder.delete(request.name)

        self._change(page, work, lambda _: f"{request.name} is deleted")

    def _annotate(self, page: Page, request: requests.Annotate) -> None:
        work = partial(self._hub.folder.annotate, request.name, request.text)
        self._change(page, work, lambda _: f"Notes on {request.name} are saved")

    def _change(self, page: Page, work: Callable[[], _T], said: Callable[[_T], str]) -> None:
        """Change the folder, and say to every page what has been done."""

        def done(outcome: _T) -> None:
            self._hub.runner.say("folder", said(outcome))
            self._list(page)

        self._hub.tasks.run(page, work, done)

    def _list_sources(self, page: Page, _: requests.ListSources) -> None:
        def answer(offers: list[Offer]) -> None:
            page.post(self._sources(offers).json)

        self._hub.tasks.run(page, self._switch.offers, answer)

    def _sources(self, offers: list[Offer]) -> Sources:
        status = self._hub.runner.status()
        return Sources(
            sources=offers,
            current=self._switch.spec,
            host_protocol=f"{SCHEMA.major}.{SCHEMA.minor}",
            board=None if status.board is None else _identity(status.board, status.board_name),
            problem=status.problem,
        )

    def _go(self, page: Page, switch: Callable[[], None]) -> None:
        """Have the source switched, and show every page the new one."""
        self._hub.tasks.run(page, switch, lambda _: self._hub.show())

    def _play(self, name: str) -> None:
        self._switch.play(self._complete(name))

    def _export(self, page: Page, request: requests.ExportSession) -> None:
        if self._use.exporting is not None:
            raise WireError(f"{self._use.exporting} is being exported: wait until it has ended")
        self._use.exporting, self._use.share = request.name, 0.0

        def work() -> Path:
            try:
                return self._written(self._complete(request.name), request.format)
            finally:
                self._use.exporting = None

        def done(path: Path) -> None:
            self._hub.tell(Exported(name=path.name))
            self._list(page)

        self._hub.tasks.run(page, work, done)

    def _written(self, path: Path, form: str) -> Path:
        ending = ".csv" if form == "touches" else f".{form}"
        stem = f"{path.stem}-touches" if form == "touches" else path.stem
        write = export_touches if form == "touches" else WRITERS[ending]
        out = self._hub.folder.free(stem, ending)
        with SessionReader(path) as session:
            write(Export(session, _EVERY, self._advance), out)
        return out

    def _advance(self, done: float, total: float) -> None:
        self._use.share = done / total if total else 0.0

    def _complete(self, name: str) -> Path:
        self._use.check_ended(name)
        return self._hub.folder.existing(name, SESSION)
