"""The board of a replay: agrees to everything, and says who it was."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tomoskin.wire import (
    OLDER,
    SCHEMA,
    Ack,
    Deframer,
    GetInfo,
    Hello,
    Info,
    Reset,
    Result,
    Start,
    Stop,
    decode_payload,
    encode,
    is_command,
    type_byte,
)

if TYPE_CHECKING:
    from tomoskin.skin import Skin


((_VERSION, _HASH),) = OLDER.items()
"""It speaks the oldest protocol: what it cannot be asked need not be made up."""


class ReplayBoard:
    """Answers commands as the board that was recorded would; no I/O.

    ``scanning`` says whether it has been started.
    """

    def __init__(self, skin: Skin, device: dict[str, Any]) -> None:
        """``device`` is what the session holds of the board, perhaps nothing."""
        self._skin, self._device = skin, device
        self._deframer = Deframer(SCHEMA.to_device_bytes)
        self._out = bytearray(encode(Hello(*_VERSION, _HASH)))
        self.scanning = False

    def obey(self, data: bytes) -> None:
        """Act on commands."""
        for payload in self._deframer.feed(data):
            command = decode_payload(payload, 0.0)
            if command is None or not is_command(command):
                continue
            if isinstance(command, Start | Stop):
                self.scanning = isinstance(command, Start)
            if isinstance(command, GetInfo):
                self._out += encode(self._info(command.request))
            else:
                self._out += encode(Ack(command.request, type_byte(type(command)), Result.OK, 0))

    def answer(self) -> bytes:
        """What it has to say, once."""
        data = bytes(self._out)
        self._out.clear()
        return data

    @property
    def _channels(self) -> int:
        """Of the board that was recorded; never fewer than the skin has electrodes."""
        recorded = self._device.get("channels")
        return max(recorded if isinstance(recorded, int) else 0, self._skin.n_electrodes)

    def _info(self, request: int) -> Info:
        skin = self._skin
        return Info(
            request=request,
            major=_VERSION[0],
            minor=_VERSION[1],
            schema_hash=_HASH,
            firmware=_version(self._device.get("firmware")),
            reset=Reset.UNKNOWN,
            channels=self._channels,
            adc_bits=skin.readout.adc_bits,
            max_oversampling=64,
            max_drives=2**16 - 1,
            max_samples=2**16 - 1,
            tick_rate=round(self._device.get("tick_rate", skin.readout.tick_rate)),
            current=round(skin.current * 1e6),
            max_baud=0,
            unique_id=_identity(self._device.get("unique_id")),
        )


def _version(text: Any) -> bytes:
    """Three numbers of "1.2.3"; zeros where it says no such."""
    parts = str(text or "").split(".")
    is_version = len(parts) == 3 and all(part.isdigit() and int(part) < 256 for part in parts)
    return bytes(map(int, parts)) if is_version else bytes(3)


def _identity(text: Any) -> bytes:
    try:
        identity = bytes.fromhex(str(text or ""))
    except ValueError:
        identity = b""
    return identity if len(identity) == 8 else b"replay\0\0"
