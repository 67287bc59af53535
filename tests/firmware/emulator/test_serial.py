"""A serial port as on a bench: it resets the board, is pulled out, and loses its host."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from firmware.boards import PATIENCE, SCAN, SETTINGS, Talk, running
from firmware.emulator.test_emulator import frames_of
from firmware.emulator.watch import CLOCK, Watch
from tomoskin.board.source import Link, SerialTransport, open_source
from tomoskin.board.wire import Fault, FaultCode, Reset
from tomoskin.files.session import SessionReader
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import Runner, commands
from tomoskin.twin import TwinSettings, TwinSkin
from tomoskin_emulator.board_process import SkinMemory
from tomoskin_emulator.program import Programs
from tomoskin_emulator.source import front_of

HOST = """
import sys
from firmware.boards import SCAN, SETTINGS
from tomoskin.core import Frame
from tomoskin.board.source import Link, SerialTransport
link = Link(SerialTransport(sys.argv[1]), SCAN, SETTINGS)
while not any(isinstance(item, Frame) for item in link.poll(0.05)):
    pass
print("scans", flush=True)
while True:
    link.poll(0.05)
"""


def begun(watch: Path) -> bool:
    return Watch.read(watch).cycle > 0.01 * CLOCK


def test_opening_the_port_resets_the_board_each_time(programs: Programs, tmp_path: Path) -> None:
    watch = tmp_path / "watch"
    options = ("-f", "-r", "-w", str(watch), str(programs.elf))
    with running(programs.emulator, tmp_path / "port", *options) as board:
        while not (watch.exists() and watch.stat().st_size and begun(watch)):
            pass  # a reset before its first instructions is power coming up
        for opened in (1, 2):
            with Link(SerialTransport(board.path), SCAN, SETTINGS) as link:
                frames = frames_of(link, 3)
                assert link.session.info is not None
                assert link.session.info.reset is Reset.EXTERNAL
                assert [frame.sequence for frame in frames[:3]] == [0, 1, 2]
                # HELLO was awaited: what the bootloader swallows would have been asked again
                assert link.session.commands._request == 9
            seen = Watch.read(watch)
            assert seen.resets == opened
            while Watch.read(watch).cycle < seen.cycle + 0.01 * CLOCK:
                pass  # closed for long enough to be noticed


def test_a_killed_host_leaves_all_channels_off(programs: Programs, tmp_path: Path) -> None:
    watch = tmp_path / "watch"
    options = ("-w", str(watch), str(programs.elf))
    with running(programs.emulator, tmp_path / "port", *options) as board:
        host = subprocess.Popen(
            [sys.executable, "-c", HOST, board.path],
            stdout=subprocess.PIPE,
            env={"PYTHONPATH": ":".join(sys.path)},
        )
        assert host.stdout is not None
        assert host.stdout.readline() == b"scans\n"
        host.send_signal(signal.SIGKILL)
        host.wait()
        host.stdout.close()
        killed = Watch.read(watch).cycle
        talk = Talk(SerialTransport(board.path))
        assert talk.next(Fault).code is FaultCode.HOST_SILENT
        talk.transport.close()
        seen = Watch.read(watch)
    assert not seen.connected
    assert seen.since - killed < 2.1 * CLOCK  # the heartbeat is 2 s


@pytest.fixture(scope="module")
def skin() -> Skin:
    return Skin.load("textile-disc-8")


def test_unplugged_and_plugged_in_again_the_session_goes_on(
    programs: Programs, skin: Skin, tmp_path: Path
) -> None:
    port, path = tmp_path / "port", tmp_path / "session.mcap"
    settings = TwinSettings.preset("ideal")
    front, resistance = front_of(skin, settings), TwinSkin.of(skin, settings).resistance()
    SkinMemory(tmp_path / "skin", front, resistance).close()
    options = ("-s", str(tmp_path / "skin"), str(programs.elf))
    came = threading.Semaphore(0)
    runner = Runner(prepare(skin), lambda: open_source(f"serial:{port}", skin))
    with runner.audience.watch(came.release):
        with running(programs.emulator, port, *options) as board:
            runner.start()
            runner.ask(commands.Record(path))
            _await(came, 20)
            board.kill()
        with running(programs.emulator, port, *options):
            _drain(came)
            _await(came, 20)
            runner.stop()
    with SessionReader(path) as session:
        events = [(event.kind, event.text) for event in session.events()]
        sequences = [item.frame.sequence for item in session.frames()]
    kinds = [kind for kind, _ in events if kind in {"connected", "source-lost"}]
    assert kinds == ["connected", "source-lost", "connected"], events
    begins = [n for n, sequence in enumerate(sequences) if sequence == 0]
    assert len(begins) == 2
    assert min(begins[1], len(sequences) - begins[1]) >= 10


def _await(came: threading.Semaphore, count: int) -> None:
    for _ in range(count):
        assert came.acquire(timeout=PATIENCE)


def _drain(came: threading.Semaphore) -> None:
    while came.acquire(blocking=False):
        pass
