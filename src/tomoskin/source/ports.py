"""Serial ports of this computer, and which of them a board could be behind."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.core import SourceError

_MEGA = "Arduino Mega 2560"
_KNOWN = {
    (0x2341, 0x0010): _MEGA,
    (0x2341, 0x0042): _MEGA,
    (0x2341, 0x0242): _MEGA,
    (0x2A03, 0x0010): _MEGA,
    (0x2A03, 0x0042): _MEGA,
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
"""What is behind a USB serial port, by vendor and product (the USB ID repository)."""

AUTO = "auto"
"""Instead of a port: the one that a board could be behind."""


@dataclass(frozen=True, slots=True)
class Port:
    """A serial port; ``board`` says what is behind it, empty where nobody knows."""

    device: str
    board: str

    def __str__(self) -> str:
        """``/dev/ttyACM0 (Arduino Mega 2560)``."""
        return f"{self.device} ({self.board})" if self.board else self.device


def list_ports() -> tuple[Port, ...]:
    """The ports that are connected, those of known boards first."""
    from serial.tools.list_ports import comports  # noqa: PLC0415 - only who has a board needs it

    found = (Port(port.device, _KNOWN.get((port.vid, port.pid), "")) for port in comports())
    return tuple(sorted(found, key=lambda port: (port.board != _MEGA, not port.board, port.device)))


def say_ports() -> str:
    """The ports in words."""
    found = ", ".join(map(str, list_ports()))
    return f"ports here: {found}" if found else "no serial port is connected"


def only_board() -> str:
    """The one port with a Mega 2560, or else the one with a known bridge.

    Raises
    ------
    SourceError
        When there is none, or more than one: opening a port resets what is behind it.
    """
    ports = list_ports()
    candidates = [port for port in ports if port.board == _MEGA] or [p for p in ports if p.board]
    if len(candidates) == 1:
        return candidates[0].device
    raise SourceError(
        f"expected one board, found {len(candidates)}",
        where=f"serial:{AUTO}",
        hint=f"name its port, such as serial:/dev/ttyACM0; {say_ports()}",
    )
