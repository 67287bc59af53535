"""Requests about the source: what can be connected, what the board is, another source."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tomoskin.board.source import BOARDS, DEFAULT_BOARD, Transport, list_ports, open_source
from tomoskin.board.wire import SCHEMA, Info
from tomoskin.core import SourceError
from tomoskin.files.session import ReplayTransport, SessionReader, as_recorded, parse_replay
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared
from tomoskin.run import commands
from tomoskin.server.hub import Hub
from tomoskin.server.page_connection import Page
from tomoskin.server.page_messages import BoardNow, Offer, Sources
from tomoskin.server.requests import Connect, ListSources

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
        runner.ask(commands.Change(prepared, partial(_replay, path, prepared.skin)))
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


def _replay(path: Path, skin: Skin) -> Transport:
    return ReplayTransport(SessionReader(path), skin)


class SourceHandlers:
    """Connects the sources of a list, and no others: a page gives no path and no address."""

    def __init__(self, hub: Hub, switch: SourceSwitch) -> None:
        self._hub, self._switch = hub, switch
        hub.serve({ListSources: self._list, Connect: self._connect})

    def _list(self, page: Page, _: ListSources) -> None:
        def answer(offers: list[Offer]) -> None:
            page.post(self._message(offers).json)

        self._hub.tasks.run(page, self._switch.offers, answer)

    def _connect(self, page: Page, request: Connect) -> None:
        work = partial(self._switch.connect, request.source)
        self._hub.tasks.run(page, work, lambda _: self._hub.show())

    def _message(self, offers: list[Offer]) -> Sources:
        status = self._hub.runner.status()
        return Sources(
            sources=offers,
            current=self._switch.spec,
            host_protocol=f"{SCHEMA.major}.{SCHEMA.minor}",
            board=None if status.board is None else _identity(status.board, status.board_name),
            problem=status.problem,
        )


def _identity(info: Info, name: str) -> BoardNow:
    return BoardNow.of(
        info,
        name=name,
        firmware=".".join(map(str, info.firmware)),
        protocol=f"{info.major}.{info.minor}",
        current_ma=info.current / 1e3,
        unique_id=info.unique_id.hex(),
    )
