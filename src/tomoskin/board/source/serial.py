"""Serial ports: which there are, and bytes from one."""

from __future__ import annotations

import errno
import os
import select
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tomoskin.board.source.boards import BOARDS
from tomoskin.board.source.transport import ReadAhead, read_options
from tomoskin.core import SourceError

if TYPE_CHECKING:
    from serial import Serial

    from tomoskin.model.skin import Skin


BAUD = 1_000_000
"""Rate that the firmware starts with: exact at 16 MHz."""

SIGN_ON = bytes.fromhex("1b 01 00 01 0e 01 14")
"""Asks the bootloader of a Mega 2560 who it is (STK500v2, AVR068: CMD_SIGN_ON in a message)."""

SIGN_ON_RATE = 115_200
_ANSWER = (b"\x1b\x01", b"\x0e\x01")

_TEXT = 0.9
"""Part of the bytes that is printable where something speaks in words."""

_SHOWN = 40


def likely_cause(
    port: str, board: str, *, rate: int, heard: bytes, bootloader: bytes, ports: str
) -> SourceError:
    """Why no board has said HELLO behind a ``port``, and what to do.

    ``board`` is what its USB identity says, or nothing; ``heard`` are the first bytes that came at
    ``rate`` Bd, ``bootloader`` what came when a bootloader was asked. ``ports`` names those here.
    """
    by_drive = [key for key, one in BOARDS.items() if one.text == board and one.flash == "uf2"]
    flash = "tomoskin firmware flash " + (f"--board {by_drive[0]}" if by_drive else port)
    not_messages = f"the bytes that arrive at {rate:,} Bd are not messages: "
    if is_bootloader(bootloader):
        text, hint = "the board is in its bootloader and has no firmware", flash
    elif is_text(heard):
        letters = (chr(byte) if 32 <= byte < 127 else " " for byte in heard)
        shown = " ".join("".join(letters).split())[:_SHOWN]
        text = f'another program or device answers ("{shown}"), or this is the wrong port'
        hint = f"{flash}, or {ports}"
    elif heard and rate != BAUD:
        text = f"{not_messages}the rate is probably wrong"
        hint = f"leave out baud=: the firmware starts with {BAUD:,} Bd"
    elif heard:
        text = f"{not_messages}probably another program runs on the board"
        hint = f"{flash}; firmware of another rate needs serial:{port},baud=RATE"
    elif board:
        text = f"the board ({board}) sends nothing: it probably has no firmware"
        hint = f"{flash}; check also that it has power"
    else:
        text = "nothing arrives: this is probably the wrong port, or the board has no power"
        hint = ports
    return SourceError(text, where=f"serial:{port}", hint=hint)


def is_bootloader(answer: bytes) -> bool:
    """Whether that is a bootloader's answer to :data:`SIGN_ON`."""
    return answer[:2] == _ANSWER[0] and answer[4:6] == _ANSWER[1]


def is_text(heard: bytes) -> bool:
    """Whether the bytes read as text."""
    printable = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in heard)
    return bool(heard) and printable >= _TEXT * len(heard)


_BRIDGES = {
    (0x1A86, 0x7523): "CH340, as on many boards",
    (0x1A86, 0x5523): "CH341, as on many boards",
    (0x1A86, 0x55D4): "CH9102, as on many boards",
    (0x0403, 0x6001): "FTDI FT232, as on some boards",
    (0x0403, 0x6010): "FTDI FT2232, as on some boards",
    (0x0403, 0x6014): "FTDI FT232H, as on some boards",
    (0x0403, 0x6015): "FTDI FT231X, as on some boards",
    (0x10C4, 0xEA60): "CP210x, as on some boards",
    (0x067B, 0x2303): "PL2303, as on some boards",
}
"""What may be a board's bridge from USB, by vendor and product (the USB ID repository)."""

AUTO = "auto"
"""Instead of a port: the one that a board could be behind."""


@dataclass(frozen=True, slots=True)
class Port:
    """A serial port; ``board`` says what is behind it, empty where nobody knows."""

    device: str
    board: str

    @property
    def is_board(self) -> bool:
        """Whether it is a board that tomoskin knows, not just some bridge."""
        return any(self.board == board.text for board in BOARDS.values())

    def __str__(self) -> str:
        """``/dev/ttyACM0 (Arduino Mega 2560)``."""
        return f"{self.device} ({self.board})" if self.board else self.device


def list_ports() -> tuple[Port, ...]:
    """The ports that are connected, those of known boards first."""
    from serial.tools.list_ports import comports  # noqa: PLC0415 - only who has a board needs it

    boards = {usb: board.text for board in BOARDS.values() for usb in board.usb}
    known = _BRIDGES | boards
    ports = (Port(port.device, known.get((port.vid, port.pid), "")) for port in comports())
    return tuple(sorted(ports, key=lambda port: (not port.is_board, not port.board, port.device)))


def say_ports() -> str:
    """The names of the ports, in words."""
    ports = ", ".join(map(str, list_ports()))
    return f"ports here: {ports}" if ports else "no serial port is connected"


def only_board() -> str:
    """The one port with a known board, or else the one with a known bridge.

    Raises
    ------
    SourceError
        When there is none, or more than one: opening a port resets what is behind it.
    """
    ports = list_ports()
    candidates = [port for port in ports if port.is_board] or [p for p in ports if p.board]
    if len(candidates) == 1:
        return candidates[0].device
    raise SourceError(
        f"expected one board, found {len(candidates)}",
        where=f"serial:{AUTO}",
        hint=f"give the board's port, such as serial:/dev/ttyACM0; {say_ports()}",
    )


_CHECK = "check cable and power"
_WRITE_TIMEOUT = 1.0
_CHUNK = 65536
_FETCH = 0.5
"""s that the reader's thread waits for bytes, unless it is ended before."""

_ASKED = 0.3
"""A bootloader answers within so many s."""


class SerialTransport:
    """Bytes through a serial port; opened for this process alone."""

    def __init__(self, port: str, baud: int = BAUD) -> None:
        """Open ``port``; SourceError says whether it is absent, busy or forbidden."""
        import serial  # noqa: PLC0415 - only who has a board needs pyserial

        self.name, self._port = f"serial:{port}", port
        self._closed = False
        try:
            self._serial: Serial = serial.Serial(
                port, baud, timeout=_FETCH, write_timeout=_WRITE_TIMEOUT, exclusive=True
            )
        except (OSError, ValueError) as error:
            raise _refusal(port, error) from None
        self._ahead = ReadAhead(self._fetch, self._serial.cancel_read)

    def read(self, timeout: float) -> bytes:
        """What has come, waiting at most ``timeout`` s for the first byte."""
        if self._closed:
            raise SourceError("the port is closed", where=self.name, hint=_CHECK)
        return self._ahead.read(timeout)

    @property
    def waited(self) -> float:
        """How long the first byte of the last read had waited here, s."""
        return self._ahead.waited

    def _fetch(self) -> bytes:
        port = self._serial
        try:
            if sys.platform == "win32":
                return port.read(1) + port.read(port.in_waiting)
            # as pyserial does, but in two calls of the system instead of five
            own, data = port.fileno(), b""
            ready, _, _ = select.select([own, port.pipe_abort_read_r or own], [], [], _FETCH)
            with suppress(BlockingIOError):
                if own in ready and not (data := os.read(own, _CHUNK)):
                    raise OSError("it has nothing more to give")
            return data
        except (OSError, TypeError) as error:  # TypeError: when closed meanwhile
            raise self._gone(error) from None

    def write(self, data: bytes) -> None:
        """Send ``data`` to the board at this port."""
        try:
            self._serial.write(data)
        except (OSError, TypeError) as error:
            raise self._gone(error) from None

    @property
    def rate(self) -> int:
        """Bits per second on the line."""
        return int(self._serial.baudrate)

    def use_rate(self, rate: int) -> None:
        """Send and read at ``rate`` Bd from now on."""
        try:
            self._serial.flush()
            self._serial.baudrate = rate
        except (OSError, ValueError, TypeError) as error:
            raise self._gone(error) from None

    def diagnose(self, heard: bytes) -> SourceError:
        """Why no board answers: where nothing was ``heard``, a bootloader is asked too."""
        board = next((port.board for port in list_ports() if port.device == self._port), "")
        answer = b"" if heard else self._ask_bootloader()
        return likely_cause(
            self._port,
            board,
            rate=self.rate,
            heard=heard,
            bootloader=answer,
            ports=say_ports(),
        )

    def _ask_bootloader(self) -> bytes:
        """What comes when a bootloader is asked who it is."""
        rate, answer, end = self.rate, b"", time.monotonic() + _ASKED
        self.use_rate(SIGN_ON_RATE)
        self.write(SIGN_ON)
        while (rest := end - time.monotonic()) > 0 and not is_bootloader(answer):
            answer += self.read(rest)
        self.use_rate(rate)
        return answer

    def close(self) -> None:
        """Close the port, if it is still open."""
        if not self._closed:
            self._closed = True
            self._ahead.close()
            self._serial.close()

    def _gone(self, error: Exception) -> SourceError:
        reason = "the port is closed" if self._closed else "the board has been disconnected"
        return SourceError(f"{reason}: {error}", where=self.name, hint=_CHECK)


def open_serial(argument: str, skin: Skin) -> SerialTransport:  # noqa: ARG001 - a source's signature
    """The source ``serial:PORT``, ``serial:auto`` or ``serial:PORT,baud=RATE``."""
    port, _, rest = argument.partition(",")
    port = only_board() if port == AUTO else port
    if not port:
        raise SourceError(
            "expected a port, such as serial:/dev/ttyACM0, or serial:auto; got none",
            where="serial",
            hint=say_ports(),
        )
    text = read_options(rest, ("baud",), f"serial:{port}").get("baud", str(BAUD))
    if not text.isdigit() or not 300 <= int(text) <= 4_000_000:
        raise SourceError(
            f'expected a rate from 300 to 4,000,000 Bd, got "{text}"', where=f"serial:{port}"
        )
    return SerialTransport(port, int(text))


def _refusal(port: str, error: Exception) -> SourceError:
    where = f"serial:{port}"
    number = getattr(error, "errno", None)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return SourceError("there is no such port", where=where, hint=say_ports())
    if number == errno.EACCES:
        return SourceError(
            "you have no permission to use the port",
            where=where,
            hint="on Linux, add yourself to the group that owns it, often dialout",
        )
    if number in (errno.EBUSY, errno.EAGAIN):
        return SourceError(
            "another program is using the port", where=where, hint="close the other program first"
        )
    return SourceError(f"the port cannot be opened: {error}", where=where)
