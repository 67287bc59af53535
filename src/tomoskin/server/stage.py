"""Which source runs, and how a page changes it: a recording, back to live, another board."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tomoskin.core import SourceError
from tomoskin.pipeline import Prepared
from tomoskin.recording import ReplayTransport, SessionReader, as_recorded, parse_replay
from tomoskin.server.hub import Hub
from tomoskin.skin import Skin
from tomoskin.source import Transport, list_ports, open_source


@dataclass(frozen=True, slots=True)
class Offer:
    """A source that a page may choose: what opens it, and in words what it is."""

    id: str
    text: str


@dataclass(frozen=True, slots=True)
class _Live:
    spec: str
    prepared: Prepared


class Stage:
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
        found = {"twin": "Simulated skin (twin)", "emulator": "Real firmware, simulated board"}
        found |= {f"serial:{port.device}": str(port) for port in list_ports()}
        if not self._home.startswith("replay:"):
            found = {self._home: found.get(self._home, self._home)} | found
        return [Offer(id, text) for id, text in found.items()]

    def connect(self, spec: str) -> None:
        """Go on with one of :meth:`offers`. Raises SourceError."""
        if spec not in {offer.id for offer in self.offers()}:
            raise SourceError("expected one of the sources that are listed", where=spec[:80])
        prepared = self._live.prepared if self._live else self._hub.runner.prepared
        self._go(_Live(spec, prepared))

    def play(self, path: Path) -> None:
        """Play a recording with its own skin. Raises DataError, SourceError."""
        runner = self._hub.runner
        with SessionReader(path) as session:
            prepared = as_recorded(session)
        live = self._live or _Live(self.spec, runner.prepared)
        runner.change(prepared, partial(_replay, path, prepared.skin))
        self._live, self.spec, self._hub.opener = live, f"replay:{path.name}", None

    def back(self) -> None:
        """From a recording to the source before it. Raises SourceError."""
        if self._live is None:
            raise SourceError("no recording is being played")
        if self._live.spec.startswith("replay:"):
            raise SourceError("there is no live source to go back to: connect one")
        self._go(self._live)

    def _go(self, live: _Live) -> None:
        self._hub.runner.change(live.prepared, partial(open_source, live.spec, live.prepared.skin))
        self._live, self.spec = None, live.spec
        self._hub.opener = partial(open_source, live.spec)


def _replay(path: Path, skin: Skin) -> Transport:
    return ReplayTransport(SessionReader(path), skin)
