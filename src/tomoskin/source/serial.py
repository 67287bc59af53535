"""A board on a serial port, by pyserial."""

from __future__ import annotations

import errno
from typing import TYPE_CHECKING

from tomoskin.core import SourceError
from tomoskin.source.ports import AUTO, only_board, say_ports
from tomoskin.source.registry import read_options

if TYPE_CHECKING:
    from serial import Serial

    from tomoskin.skin import Skin

BAUD = 1_000_000
"""Rate that the firmware starts with: exact at 16 MHz."""

_WRITE_TIMEOUT = 1.0
_CHUNK = 65536


class SerialTransport:
    """Bytes through a serial port; opened for this process alone."""

    def __init__(self, port: str, baud: int = BAUD) -> None:
        """Open ``port``; SourceError says whether it is absent, busy or forbidden."""
        import serial  # noqa: PLC0415 - only who has a board needs pyserial

        self.name = f"serial:{port}"
        self._closed = False
        try:
            self._serial: Serial = serial.Serial(
                port, baud, timeout=0, write_timeout=_WRITE_TIMEOUT, exclusive=True
            )
        except (OSError, ValueError) as error:
            raise _refusal(port, error) from None

    def read(self, timeout: float) -> bytes:
        """What has come, waiting at most ``timeout`` s for the first byte."""
        try:
            if self._serial.timeout != timeout:
                self._serial.timeout = timeout
            first: bytes = self._serial.read(1)
            if not first:
                return b""
            waiting = min(self._serial.in_waiting, _CHUNK)
            return first + self._serial.read(waiting) if waiting else first
        except (OSError, TypeError) as error:  # TypeError: pyserial, when closed meanwhile
            raise self._gone(error) from None

    def write(self, data: bytes) -> None:
        """Send ``data``."""
        try:
            self._serial.write(data)
        except (OSError, TypeError) as error:
            raise self._gone(error) from None

    @property
    def rate(self) -> int:
        """Bd."""
        return int(self._serial.baudrate)

    def use_rate(self, rate: int) -> None:
        """Send and read at ``rate`` Bd from now on."""
        try:
            self._serial.flush()
            self._serial.baudrate = rate
        except (OSError, ValueError, TypeError) as error:
            raise self._gone(error) from None

    def close(self) -> None:
        """Close the port."""
        if not self._closed:
            self._closed = True
            self._serial.close()

    def _gone(self, error: Exception) -> SourceError:
        reason = "the port is closed" if self._closed else "the board has gone away"
        return SourceError(f"{reason}: {error}", where=self.name, hint="check cable and power")


def open_serial(argument: str, skin: Skin) -> SerialTransport:  # noqa: ARG001 - a source's signature
    """The source ``serial:PORT``, ``serial:auto`` or ``serial:PORT,baud=RATE``."""
    port, _, rest = argument.partition(",")
    port = only_board() if port == AUTO else port
    if not port:
        raise SourceError(
            "expected a port, such as serial:/dev/ttyACM0, or serial:auto",
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
            "no permission to use the port",
            where=where,
            hint="on Linux add yourself to the group that owns it, often dialout",
        )
    if number in (errno.EBUSY, errno.EAGAIN):
        return SourceError("another program is using the port", where=where, hint="close it first")
    return SourceError(f"the port cannot be opened: {error}", where=where)
