"""An hour of a bad day, compressed: a line that damages, reboots, unplugging, a sick electrode."""

from __future__ import annotations

import os
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from report import Report
from served import served
from tomoskin.board.source import Configuration, ScanSettings
from tomoskin.board.wire import Decoder
from tomoskin.core import Frame, SourceError, WallClock
from tomoskin.files.session import session_info
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import Runner, commands
from tomoskin.twin import (
    Faults,
    Line,
    LineSettings,
    Press,
    TwinSettings,
    TwinTransport,
    make_twin,
)

SKIN, SEED = "textile-disc-8", 7
MINUTES = 60.0
LINE = LineSettings(loss=2e-5, corruption=2e-5)

_PRESS, _REBOOT, _UNPLUG, _CUT = 11.0, 97.0, 211.0, 61.0
"""Seconds of the board between two presses, reboots, unpluggings, and electrodes cut or mended."""

_SETTLED = 0.2
"""Part of the run after which memory must stand still."""

_LOOK, _PATIENCE = 0.2, 60.0
"""Seconds between two looks, and after which a run in which nothing happens has failed."""

_MB = 2.0**20


@dataclass
class Account:
    """Frames on their way from the board to the pipeline, and seconds of the board."""

    sent: int = 0
    arrived: int = 0
    seconds: float = 0.0
    happened: dict[str, int] = field(default_factory=dict)

    def happens(self, what: str, period: float, step: float) -> bool:
        """Whether the board's time has just passed a multiple of ``period``."""
        due = int(self.seconds / period) > int((self.seconds - step) / period)
        if due:
            self.happened[what] = self.happened.get(what, 0) + 1
        return due


class BadDay:
    """A twin without waiting, on a line that damages; faults at fixed times of the board.

    Counts the frames before and behind the line, whatever the host makes of them.
    """

    name = "twin"

    def __init__(self, skin: Skin, account: Account, minutes: float, period: float) -> None:
        self._twin: TwinTransport = make_twin(skin, TwinSettings(seed=SEED), WallClock(), pace=0.0)
        self._line = Line(LINE, SEED + account.sent)
        self._before, self._behind = Decoder(), Decoder()
        self._account, self._end, self._period = account, 60 * minutes, period
        self._pulled = False

    def read(self, timeout: float) -> bytes:
        """Read on, and let happen what is due."""
        account = self._account
        if self._pulled:
            raise SourceError("the plug was pulled", where=self.name)
        if account.seconds >= self._end:
            time.sleep(timeout)  # over: nothing comes any more
            return b""
        clean = self._twin.read(timeout)
        frames = _frames(self._before, clean)
        step = frames * self._period
        account.sent += frames
        account.seconds += step
        data = self._line.carry(clean)
        account.arrived += _frames(self._behind, data)
        if step:
            self._let_happen(step)
        return data

    def write(self, data: bytes) -> None:
        """To the twin, unharmed."""
        self._twin.write(data)

    def close(self) -> None:
        """Switch it off."""
        self._twin.close()

    def _let_happen(self, step: float) -> None:
        account = self._account
        if account.happens("presses", _PRESS, step):
            odd = account.happened["presses"] % 2
            self._twin.set_presses((Press(0.03, -0.02, 4.0, 0.015),) if odd else ())
        if account.happens("cuts", _CUT, step):
            odd = account.happened["cuts"] % 2
            self._twin.set_faults(Faults(cut=frozenset({3})) if odd else Faults())
        if account.happens("reboots", _REBOOT, step):
            self._twin.reboot()
        if account.happens("unpluggings", _UNPLUG, step):
            self._pulled = True


class Hanging:
    """A sink that takes one result and never comes back."""

    name = "hanging"

    def __init__(self) -> None:
        self._never = threading.Event()

    def open(self, stream: object) -> None:
        """Nothing to open."""

    def publish(self, item: object) -> None:  # noqa: ARG002
        """Hang until it is closed."""
        self._never.wait()

    def close(self) -> None:
        """Come back."""
        self._never.set()


@dataclass(frozen=True)
class Outcome:
    """What became of the frames of a run, and of its memory and file."""

    account: Account
    wall: float
    taken: int
    dropped: int
    recorded: int
    lost: int
    torn: str
    growth_mb: float
    left_out: int

    @property
    def damaged(self) -> int:
        """Frames that the line damaged or lost."""
        return self.account.sent - self.account.arrived

    @property
    def unaccounted(self) -> int:
        """Frames that arrived and of which nobody can say what became of them."""
        return self.account.arrived - self.taken - self.dropped


def soak(minutes: float, folder: Path) -> Outcome:
    """Run for ``minutes`` of the board's time, recording into ``folder``."""
    skin = Skin.load(SKIN)
    prepared = prepare(skin)
    account = Account()
    period = 1.0 / frame_rate(skin)
    runner = Runner(
        prepared, lambda: BadDay(skin, account, minutes, period), sinks=[sink := Hanging()]
    )
    memory, begun, file = [], time.monotonic(), folder / "soak.mcap"
    runner.ask(commands.Record(file))  # from the first byte on
    runner.start()
    try:
        with sleeping_page(runner):
            for at in _looks(account, 60 * minutes):
                memory.append((at, _resident()))
            _until_idle(runner, account)
        status, wall = runner.status(), time.monotonic() - begun
    finally:
        sink.close()
        runner.stop()
    left_out = sum(report.left_out for report in status.sinks)
    info = session_info(file)
    settled = [mb for at, mb in memory if at > _SETTLED * 60 * minutes]
    return Outcome(
        account=account,
        wall=wall,
        taken=status.frames,
        dropped=status.dropped,
        recorded=info.frames,
        lost=info.lost,
        torn=info.torn,
        growth_mb=settled[-1] - settled[0],
        left_out=left_out,
    )


@contextmanager
def sleeping_page(runner: Runner) -> Iterator[None]:
    """The server, with a page that opens and then reads nothing."""
    with socket.socket() as page, served(runner) as policy:
        page.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        page.connect(("127.0.0.1", policy.port))
        page.sendall(
            f"GET /ws?token={policy.token} HTTP/1.1\r\nHost: 127.0.0.1:{policy.port}\r\n"
            "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
        )
        yield


def frame_rate(skin: Skin) -> float:
    """Frames/s of the skin's board."""
    scan = Configuration.of(Scan.of(skin.pattern()), ScanSettings.of(skin))
    return 1.0 / scan.scan_time


def run(data: Path | None) -> tuple[Report, ...]:
    """One hour; ``data`` is not needed."""
    del data
    with tempfile.TemporaryDirectory() as folder:
        found = soak(MINUTES, Path(folder))
    account = found.account
    row = (
        round(account.seconds / 60),
        round(found.wall),
        account.sent,
        found.damaged,
        found.taken,
        found.dropped,
        found.unaccounted,
        found.recorded,
        found.growth_mb,
    )
    columns = (
        *("minutes", "wall s", "sent", "damaged", "taken", "dropped"),
        *("unaccounted", "recorded", "growth MB"),
    )
    happened = ", ".join(f"{count} {what}" for what, count in account.happened.items())
    notes = (
        f"{SKIN}, seed {SEED}; {happened}; a page that sleeps, a sink that hangs",
        "sent by the board; damaged or lost on the line; taken by the pipeline, or dropped because "
        "newer ones waited or they were of an older set-up",
        f"growth of the resident memory after the first fifth; file {found.torn or 'whole'}",
    )
    return (Report("soak", columns, (row,), notes),)


def _looks(account: Account, end: float) -> Iterator[float]:
    """Now and then the board's time, s, until it is ``end``."""
    at, moved = -1.0, time.monotonic()
    while at < end:
        time.sleep(_LOOK)
        if at != (at := account.seconds):
            moved = time.monotonic()
        elif time.monotonic() - moved > _PATIENCE:
            raise SourceError(f"nothing has come for {_PATIENCE:g} s", where=f"{at:.0f} s")
        yield at


def _until_idle(runner: Runner, account: Account) -> None:
    """Wait until it is known of every frame that arrived what became of it, or nothing changes."""
    known, since = -1, time.monotonic()
    while known < account.arrived and time.monotonic() - since < _PATIENCE:
        time.sleep(_LOOK)
        status = runner.status()
        if known != (known := status.frames + status.dropped):
            since = time.monotonic()


def _frames(decoder: Decoder, data: bytes) -> int:
    return sum(isinstance(message, Frame) for message in decoder.feed(data, 0.0))


def _resident() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / _MB
