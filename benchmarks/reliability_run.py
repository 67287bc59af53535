"""Runs that are killed, a disk that is full, a broker that is not there or says nothing."""

from __future__ import annotations

import os
import random
import resource
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path

from tomoskin.board.source import open_source
from tomoskin.core import DataError
from tomoskin.files.session import SessionReader, repair
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.run import Runner, commands
from tomoskin.run.sinks import make_sink
from trials import HANG, Judge

SKIN, SOURCE = "textile-disc-8", "twin:fast"
LONGEST = 4.0
"""Seconds of a recording after which it is killed at the latest."""

_SAVED = 2.5
"""Seconds after which something must be in the file: it is written once a second."""

_SIZES = (0, 30_000, 100_000, 200_000, 300_000)
_BROKERS = ("none", "silent", "closing")
_ENOUGH = 100
"""Frames that a run must still take."""


def prepared_skin() -> Prepared:
    """The skin of all runs."""
    return prepare(Skin.load(SKIN))


def killed(prepared: Prepared, folder: Path) -> Judge:
    """kill −9 at some moment of a recording: what is in the file is read in order, and repaired."""
    path, mended = folder / "killed.mcap", folder / "mended.mcap"

    def judge(number: int) -> str:
        path.unlink(missing_ok=True)
        mended.unlink(missing_ok=True)
        process, moment = _forked(lambda: _record(prepared, path)), random.Random(number).random()
        _until(path.exists)
        time.sleep(LONGEST * moment)
        os.kill(process.pid or 0, signal.SIGKILL)
        process.join()
        try:
            with SessionReader(path) as session:
                sequences = [item.frame.sequence for item in session.frames()]
        except DataError as error:
            if LONGEST * moment > _SAVED:
                return f"nothing after {LONGEST * moment:.1f} s: {error}"
            raise
        if sequences != list(range(len(sequences))):
            return f"{len(sequences)} frames, not in order"
        if repair(path, mended).messages.get("/frames", 0) != len(sequences):
            return "repair loses frames"
        return ""

    return judge


def full_disk(prepared: Prepared, folder: Path) -> Judge:
    """The kernel refuses to write on: the recording ends in words, the run goes on."""

    def judge(number: int) -> str:
        limit = _SIZES[number % len(_SIZES)] + 37 * number
        path = folder / f"full-{number}.mcap"
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
        try:
            wrong = _recorded_until_full(prepared, path)
        finally:
            resource.setrlimit(
                resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
            )
        if not wrong and path.stat().st_size > limit:
            wrong = "more than the limit"
        path.unlink(missing_ok=True)
        return wrong

    return judge


def brokers(prepared: Prepared) -> Judge:
    """No broker, one that says nothing, one that hangs up: frames go on, and the end is quick."""

    def judge(number: int) -> str:
        with _broker(_BROKERS[number % len(_BROKERS)]) as port:
            sink = make_sink(f"mqtt://127.0.0.1:{port}/skin")
            runner = Runner(prepared, lambda: open_source(SOURCE, prepared.skin), sinks=[sink])
            runner.start()
            _until(lambda: runner.status().frames > _ENOUGH)
            taken = runner.status().frames
            began = time.monotonic()
            runner.stop()
            if time.monotonic() - began > HANG / 2:
                return f"the end took {time.monotonic() - began:.1f} s"
        return "" if taken > _ENOUGH else f"{taken} frames"

    return judge


def _record(prepared: Prepared, path: Path) -> None:
    runner = Runner(prepared, lambda: open_source(SOURCE, prepared.skin))
    runner.ask(commands.Record(path))
    runner.start()
    threading.Event().wait()


def _recorded_until_full(prepared: Prepared, path: Path) -> str:
    runner = Runner(prepared, lambda: open_source(SOURCE, prepared.skin))
    try:
        runner.ask(commands.Record(path))
    except DataError:
        return ""  # not even the beginning fits, and it is said
    runner.start()
    try:
        _until(lambda: runner.status().recording is None)
        before = runner.status().frames
        _until(lambda: runner.status().frames > before + _ENOUGH)
        if runner.status().frames <= before:
            return "the run stands still"
        events = {event.kind: event.text for event in runner.events.since(0)[1]}
        if "too large" not in events.get("recording-stopped", ""):
            return f"the reason is not said: {events}"
    finally:
        runner.stop()
    with SessionReader(path) as session:
        list(session.frames())
    return ""


def _until(true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 0.8 * HANG
    while not true() and time.monotonic() < deadline:
        time.sleep(0.02)


def _forked(work: Callable[[], None]) -> BaseProcess:
    process = get_context("fork").Process(target=work)
    process.start()
    return process


@contextmanager
def _broker(kind: str) -> Iterator[int]:
    """A port at which there is that kind of broker."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        if kind == "none":
            listener.close()
            yield port
            return
        kept: list[socket.socket] = []

        def serve() -> None:
            try:
                while True:
                    guest, _ = listener.accept()
                    if kind == "closing":
                        guest.close()
                    else:
                        kept.append(guest)
            except OSError:
                return

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        try:
            yield port
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            for guest in kept:
                guest.close()
            thread.join()
