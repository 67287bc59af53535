"""The serial port, over a pseudo-terminal with the twin's firmware at the far end."""

import errno
import os
import select
import threading
import time
from itertools import count

import pytest
from serial.tools.list_ports_common import ListPortInfo

from board.source.boards import BOARD, SCAN, SETTINGS, Counting, frames, poll_until
from tomoskin.board.source import Link, Timing, serial as port
from tomoskin.board.source.serial import SIGN_ON
from tomoskin.core import SourceError
from tomoskin.twin.device import TwinDevice

pytest.importorskip("pty")


class Bench:
    """The twin's firmware behind a pseudo-terminal, until unplugged."""

    def __init__(self):
        import tty

        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self.device = TwinDevice(Counting(), BOARD, time.monotonic())
        self._wake, self._stop = os.pipe()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        while True:
            wait = max(self.device.due - time.monotonic(), 0.0)
            ready, _, _ = select.select([self._master, self._wake], [], [], wait)
            if self._wake in ready:
                return
            if self._master in ready:
                self.device.receive(os.read(self._master, 4096), time.monotonic())
            data = self.device.emit(time.monotonic())
            if data:
                os.write(self._master, data)

    def unplug(self):
        if self._thread.is_alive():
            os.write(self._stop, b"x")
            self._thread.join()
            for end in (self._master, self._slave, self._wake, self._stop):
                os.close(end)


@pytest.fixture
def bench():
    bench = Bench()
    yield bench
    bench.unplug()


def test_frames_through_a_port_and_a_clean_stop(bench):
    transport = port.open_serial(bench.path, None)
    assert transport.name == f"serial:{bench.path}"
    with Link(transport, SCAN, SETTINGS) as link:
        got = frames(poll_until(link, lambda items: len(frames(items)) >= 20))
        assert [frame.sequence for frame in got] == list(range(len(got)))
        assert got[3].samples.tolist() == list(range(3, 51))
        assert bench.device.driving
    assert not bench.device.driving


def test_a_port_in_use(bench):
    first = port.SerialTransport(bench.path)
    with pytest.raises(SourceError, match="another program is using the port"):
        port.SerialTransport(bench.path)
    first.close()
    first.close()
    port.SerialTransport(bench.path).close()


def test_unplugged_while_scanning(bench):
    link = Link(port.SerialTransport(bench.path), SCAN, SETTINGS)
    poll_until(link, frames)
    bench.unplug()
    with pytest.raises(SourceError, match="been disconnected"):
        poll_until(link, lambda _: False)
    link.close()


class Stranger:
    """What is behind a pseudo-terminal that no board is behind: answers once what it is asked."""

    def __init__(self, answers):
        import tty

        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self._slave, self._answers = slave, answers
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        asked = b""
        while SIGN_ON not in asked:
            asked += os.read(self._master, 4096)
        os.write(self._master, self._answers)

    def say(self, words):
        os.write(self._master, words)

    def close(self):
        os.write(self._slave, SIGN_ON)  # lets the thread end where nobody has asked
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)


@pytest.mark.parametrize(
    ("words", "says"),
    [(b"", "in its bootloader"), (b"hello from a sketch\r\n", "another program or device answers")],
)
def test_where_no_board_answers_the_likeliest_cause_is_found_and_raised(words, says):
    stranger = Stranger(bytes.fromhex("1b01000b0e010008") + b"AVRISP_2")
    timing = Timing(hello=0.1, answer=0.02, tries=2, goodbye=0.0)
    passing = count(0.0, 0.01)  # the time between two looks at the clock, whatever the load
    transport = port.SerialTransport(stranger.path)
    link = Link(transport, SCAN, SETTINGS, timing=timing, clock=lambda: next(passing))
    stranger.say(words)
    with pytest.raises(SourceError, match=says) as raised:
        poll_until(link, lambda _: False)
    assert link.diagnosis is raised.value
    assert link.transport.rate == port.BAUD
    link.close()
    stranger.close()


def test_a_read_asks_the_system_twice(bench, monkeypatch):
    calls = []
    for module, name in ((port.select, "select"), (port.os, "read")):
        ask = getattr(module, name)
        counted = lambda *given, ask=ask, name=name: calls.append(name) or ask(*given)  # noqa: E731
        monkeypatch.setattr(module, name, counted)
    transport = port.SerialTransport(bench.path)
    monkeypatch.setattr(type(transport._serial), "read", None)
    assert transport.read(5.0)
    transport.close()
    assert {"select", "read"} == set(calls)


def test_reading_and_writing_after_close(bench):
    transport = port.SerialTransport(bench.path)
    transport.close()
    for act in (lambda: transport.read(0.01), lambda: transport.write(b"x")):
        with pytest.raises(SourceError, match="the port is closed"):
            act()


def test_an_absent_port_and_none_named():
    with pytest.raises(SourceError, match=r"serial:/dev/no-such: there is no such port \(.*port"):
        port.open_serial("/dev/no-such", None)
    with pytest.raises(SourceError, match="expected a port"):
        port.open_serial("", None)


@pytest.mark.parametrize("rate", ["fast", "10", "99999999"])
def test_an_impossible_rate(rate):
    with pytest.raises(SourceError, match="rate"):
        port.open_serial(f"/dev/no-such,baud={rate}", None)


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.EACCES, "no permission .*dialout"),
        (errno.EBUSY, "another program"),
        (errno.EIO, "cannot be opened"),
    ],
)
def test_other_refusals(monkeypatch, number, said):
    import serial

    def refuse(*_args, **_named):
        raise serial.SerialException(number, "no")

    monkeypatch.setattr(serial, "Serial", refuse)
    with pytest.raises(SourceError, match=said):
        port.SerialTransport("/dev/some")


MEGA, CLONE, PLAIN = (0x2341, 0x0042), (0x1A86, 0x7523), (None, None)
PICO = (0x2E8A, 0x000A)


@pytest.mark.parametrize(
    ("there", "said"),
    [
        ({}, "expected one board, found 0 .*no serial port"),
        ({"/dev/ttyS0": PLAIN}, "found 0 .*ports here: /dev/ttyS0"),
        ({"/dev/ttyACM1": MEGA, "/dev/ttyACM0": MEGA}, r"found 2 .*ACM0 \(Arduino Mega 2560\), "),
        ({"/dev/ttyUSB0": CLONE, "/dev/ttyUSB1": CLONE}, r"found 2 .*USB0 \(CH340"),
    ],
)
def test_which_port_is_not_guessed(monkeypatch, there, said):
    connect(monkeypatch, there)
    with pytest.raises(SourceError, match=said):
        port.open_serial("auto", None)


@pytest.mark.parametrize(
    ("there", "opened"),
    [
        ({"/dev/ttyUSB0": CLONE, "/dev/ttyS0": PLAIN}, "/dev/ttyUSB0"),
        ({"/dev/ttyUSB0": CLONE, "/dev/ttyACM0": MEGA}, "/dev/ttyACM0"),
        ({"/dev/ttyUSB0": CLONE, "/dev/ttyACM0": PICO}, "/dev/ttyACM0"),
    ],
)
def test_the_only_board_is_found(monkeypatch, there, opened):
    connect(monkeypatch, there)
    monkeypatch.setattr(port, "SerialTransport", lambda *given: given)
    assert port.open_serial("auto,baud=500000", None) == (opened, 500_000)


def connect(monkeypatch, there):
    found = [ListPortInfo(device) for device in there]
    for info, (info.vid, info.pid) in zip(found, there.values(), strict=True):
        assert info.device in there
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: found)
