"""The board of a replay: agrees to everything, and says who it was."""

from __future__ import annotations

from typing import Any

from tomoskin.board import wire
from tomoskin.files.session.session_reader import stated_rate
from tomoskin.model.skin import Skin
from tomoskin.twin import Board, HeldScanning, Question, Setting

_MOST = 2**16 - 1


class ReplayBoard:
    """Answers commands as the board that was recorded would; no I/O.

    ``scanning`` says whether it has been started.
    """

    def __init__(self, skin: Skin, device: dict[str, Any]) -> None:
        """``device`` is what the session holds of the board, perhaps nothing."""
        self._held = HeldScanning(_board(skin, device))
        self._deframer = wire.Deframer(wire.SCHEMA.to_device_bytes)
        self._out = bytearray(
            wire.encode(wire.Hello(wire.SCHEMA.major, wire.SCHEMA.minor, wire.SCHEMA.hash))
        )
        self.scanning = False

    def obey(self, data: bytes) -> None:
        """Carry out the commands that these bytes hold."""
        for payload in self._deframer.feed(data):
            command = wire.decode_payload(payload, 0.0)
            if command is not None and wire.is_command(command):
                self._out += wire.encode(self._answer(command))

    def answer(self) -> bytes:
        """The answers that wait, each once."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def _answer(self, command: wire.Command) -> wire.Message:
        if isinstance(command, Question):
            return self._held.answer(command)
        if isinstance(command, Setting):
            self._held.set(command)
        elif isinstance(command, wire.Start | wire.Stop):
            self.scanning = isinstance(command, wire.Start)
        return wire.Ack(command.request, wire.type_byte(type(command)), wire.Result.OK, 0)


def _board(skin: Skin, device: dict[str, Any]) -> Board:
    """A board that is what was recorded, and has room for any scan.

    It has never fewer channels than the skin has electrodes.
    """
    channels = device.get("channels")
    name = str(device.get("name") or "").encode()[:24]
    return Board(
        channels=max(channels if isinstance(channels, int) else 0, skin.n_electrodes),
        adc_bits=skin.readout.adc_bits,
        current=skin.current,
        tick_rate=round(stated_rate(device, skin)),
        max_drives=_MOST,
        max_samples=_MOST,
        firmware=_version(device.get("firmware")),
        unique_id=_identity(device.get("unique_id")),
        limits=wire.BoardLimits(0, name.ljust(24, b"\0"), 0, _MOST, 0, 0, 0, 0),
    )


def _version(text: Any) -> tuple[int, int, int]:
    """Three numbers of "1.2.3"; zeros where it says no such."""
    parts = str(text or "").split(".")
    is_version = len(parts) == 3 and all(part.isdigit() and int(part) < 256 for part in parts)
    major, minor, patch = map(int, parts) if is_version else (0, 0, 0)
    return major, minor, patch


def _identity(text: Any) -> bytes:
    try:
        identity = bytes.fromhex(str(text or ""))
    except ValueError:
        identity = b""
    return identity if len(identity) == 8 else b"replay\0\0"
