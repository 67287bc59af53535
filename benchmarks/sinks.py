"""From the stamp of a frame to who listens to a sink, in another process: two minutes."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from bench_rig import served
from chain import LEAD, SKIN, board, control_loop, elsewhere, prepared_chain
from report import Report, Row, progress, table
from tomoskin.board.source import SerialTransport
from tomoskin.core import DataError
from tomoskin.pipeline import Prepared
from tomoskin.run import Runner
from tomoskin.run.sinks import Contacts, make_sink

SECONDS = 10.0
LOSSES = 10

SINKS = {
    "ros2": "ros2:domain=77",
    "mqtt": "mqtt://127.0.0.1:{}",
    "foxglove": "foxglove:{}",
    "lsl": "lsl",
}
"""How each is asked for; where a subscriber finds it, in braces."""

LOOP = "control loop"
"""A thread of the same program, which waits for news."""

PROMISED = 4.0, 15.0
"""ms from stamp to subscriber, median and 99 of 100."""

LOST = 0.5
"""s in which every sink says that a board is lost."""

_CLIENT = Path(__file__).with_name("sink_client.py")
_LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers>"
    "</Discovery></Domain></CycloneDDS>"
)

Messages = list[tuple[float, float, bool]]
"""When each came, the time that it is of, and whether touches are valid; s since 1970."""


def run() -> Iterator[Report]:
    """From the stamp of a frame to who listens to a sink, in another process: two minutes."""
    prepared, rows = prepared_chain(), []
    for kind in (LOOP, *SINKS):
        progress(kind)
        with _listened(prepared, (kind,)) as (heard, _):
            time.sleep(LEAD)
            before = time.time()
            time.sleep(SECONDS)
            rows.append(_row(kind, heard()[kind], before))
    yield table(
        "from the middle of a scan to a subscriber",
        rows,
        "one sink at a time, and its subscriber in a process of its own, which reads touches; "
        f"the firmware with a Pico's timing on a pty, 404 frames/s; {SKIN}; presses that go round",
        f"promised: median {PROMISED[0]:g} ms, 99 of 100 within {PROMISED[1]:g} ms",
        f"load of the machine {os.getloadavg()[0]:.1f}",
    )


def run_lost() -> Iterator[Report]:
    """Seconds from the end of a board's process to every sink that says so."""
    prepared, rows = prepared_chain(), []
    for number in range(LOSSES):
        progress(f"loss {number + 1} of {LOSSES}")
        with _listened(prepared, (LOOP, *SINKS, "page")) as (heard, kill):
            time.sleep(LEAD / 2)
            gone = time.time()
            kill()
            time.sleep(2 * LOST)
            rows.append({name: _said(told, gone) for name, told in heard().items()})
    yield table(
        f"ms until a board whose process was killed is told, {LOSSES} times",
        [
            {"sink": kind, "median": f"{np.median(ms):.0f}", "longest": f"{max(ms):.0f}"}
            for kind in rows[0]
            if (ms := [1e3 * row[kind] for row in rows])
        ],
        "all sinks at once",
        f"promised: within {1e3 * LOST:.0f} ms; load of the machine {os.getloadavg()[0]:.1f}",
    )


def _row(name: str, messages: Messages, before: float) -> Row:
    ms = np.array(
        [1e3 * (came - stamp) for came, stamp, valid in messages if came > before and valid]
    )
    return {
        "sink": name,
        "messages/s": f"{len(ms) / SECONDS:.0f}",
        "median, ms": f"{np.median(ms):.2f}",
        "99 of 100": f"{np.percentile(ms, 99):.2f}",
    }


def _said(messages: Messages, gone: float) -> float:
    """s after ``gone`` of the first message that says so; infinite where none does."""
    return next((came - gone for came, _, valid in messages if came > gone and not valid), np.inf)


@contextmanager
def _listened(
    prepared: Prepared, kinds: Sequence[str]
) -> Iterator[tuple[Callable[[], dict[str, Messages]], Callable[[], None]]]:
    """What a control loop and subscribers have heard of a board that runs; what kills the board.

    Subscribers write files: to read what they say at once would take the interpreter from the run.
    """
    os.environ["CYCLONEDDS_URI"] = _LOOPBACK
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        files = {kind: folder / kind for kind in kinds if kind != LOOP}
        ports = {kind: _free_port() for kind in files}
        if "mqtt" in kinds:
            stack.enter_context(_broker(folder, ports["mqtt"]))
        tty, process = stack.enter_context(board(prepared.skin, folder))
        sinks = [make_sink(SINKS[kind].format(ports[kind])) for kind in kinds if kind in SINKS]
        runner = Runner(prepared, lambda: SerialTransport(tty), sinks=sinks)
        runner.start()
        stack.callback(runner.stop)
        for kind, file in files.items():
            address = str(ports[kind])
            if kind == "page":
                policy = stack.enter_context(served(runner))
                address = f"ws://127.0.0.1:{policy.port}/ws?token={policy.token}"
            written = stack.enter_context(file.open("w"))
            client = elsewhere([sys.executable, str(_CLIENT), kind, address], written)
            stack.callback(client.wait)
            stack.callback(client.kill)
        own: Messages = []

        def take(contacts: Contacts) -> None:
            now = time.time()
            own.append((now, now - contacts.age_s, contacts.valid))

        if LOOP in kinds:
            stack.enter_context(control_loop(runner, take))

        def heard() -> dict[str, Messages]:
            return {kind: _read(files[kind]) if kind in files else own for kind in kinds}

        while not all(any(valid for *_, valid in messages) for messages in heard().values()):
            time.sleep(1.0)
        yield heard, process.kill


def _read(file: Path) -> Messages:
    """The whole lines of a subscriber."""
    lines = (line.split() for line in file.read_text().rpartition("\n")[0].splitlines())
    return [(float(came), float(stamp), valid == "1") for came, stamp, valid in lines]


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


@contextmanager
def _broker(folder: Path, port: int) -> Iterator[None]:
    """While mosquitto listens at ``port``."""
    program = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
    if program is None:
        raise DataError("needs mosquitto (Debian: apt-get install mosquitto)", where="bench sinks")
    settings = folder / "broker.conf"
    settings.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\nuser root\n")
    process = subprocess.Popen([program, "-c", str(settings)], stderr=subprocess.DEVNULL)
    try:
        time.sleep(1.0)
        yield
    finally:
        process.kill()
        process.wait()
