"""The source ``twin``: paced by a clock, computed when it is read; or without board and wire."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tomoskin.board.source import BOARDS, BoardRecord, ScanSettings, read_options
from tomoskin.core import Clock, Frame, SourceError, WallClock, no_such
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import ReadoutSettings, Skin
from tomoskin.twin.bend import Pose
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.electronics import TwinElectronics
from tomoskin.twin.faults import Faults, Line, LineSettings
from tomoskin.twin.held_scanning import Board
from tomoskin.twin.presets import PRESETS, TwinSettings
from tomoskin.twin.probe import Probe
from tomoskin.twin.scanning import table_of
from tomoskin.twin.sheet import TwinSkin

_CHANNELS = (8, 16, 32)
"""Sizes of the simulated board."""


class SheetTransport:
    """A source before the sheet of a twin, which can be pressed and bent from any thread."""

    def __init__(self, sheet: TwinSkin) -> None:
        self.sheet = sheet

    def set_presses(self, presses: tuple[Probe, ...]) -> None:
        """Replace all presses; they show from the next frame on.

        Raises
        ------
        GeometryError
            When the centre of one is off the skin; then nothing is changed.
        """
        self.sheet.set_presses(presses)

    def set_pose(self, pose: Pose) -> None:
        """Bend and stretch the sheet; it shows from the next frame on.

        Raises
        ------
        GeometryError
            When the sheet cannot take that shape; then nothing is changed.
        """
        self.sheet.set_pose(pose)


class TwinTransport(SheetTransport):
    """Bytes of a twin, in real time.

    One thread reads; everything else may come from any.
    """

    def __init__(
        self,
        electronics: TwinElectronics,
        device: TwinDevice,
        clock: Clock,
        line: Line | None = None,
    ) -> None:
        """``device`` must have been powered on by the same ``clock``, on the ``electronics``."""
        super().__init__(electronics.sheet)
        self._line = line or Line(LineSettings(), 0)
        self.name = "twin"
        self.device = device
        self.electronics = electronics
        self._noise = electronics.settings.noise
        self._clock = clock
        self._condition = threading.Condition()
        self._inbox = bytearray()
        self._closed = False
        self._reboot = False

    def set_faults(self, faults: Faults) -> None:
        """Break and mend; it shows from the next frame on.

        Raises
        ------
        ModelError
            For an electrode that the skin does not have; then nothing is changed.
        """
        self.electronics.set_faults(faults)

    def set_noise(self, noise: float | None) -> None:
        """Noise of one conversion, LSB, from the next frame on; None: that of its settings."""
        value = self._noise if noise is None else noise
        self.electronics.settings = replace(self.electronics.settings, noise=value)

    def reboot(self) -> None:
        """Cut the board's power for a moment: it forgets everything and says HELLO."""
        with self._condition:
            self._inbox.clear()
            self._reboot = True
            self._condition.notify()

    def read(self, timeout: float) -> bytes:
        """What the twin sends next, waiting at most ``timeout`` s; ``b""`` if nothing."""
        end = self._clock.now() + timeout
        while True:
            received, reboot = self._take()
            now = self._clock.now()
            if reboot:
                self.device.reboot(now)
            if received:
                self.device.receive(received, now)
            data = self._line.carry(self.device.emit(now))
            if data or now >= end:
                return data
            with self._condition:
                if not (self._inbox or self._closed or self._reboot):
                    self._clock.wait(self._condition, max(min(self.device.due, end) - now, 0.0))

    def write(self, data: bytes) -> None:
        """Send ``data`` to the twin's board."""
        with self._condition:
            self._check_open()
            self._inbox += data
            self._condition.notify()

    def close(self) -> None:
        """Switch the twin off and wake who waits for it."""
        with self._condition:
            self._closed = True
            self._condition.notify()

    def _take(self) -> tuple[bytes, bool]:
        with self._condition:
            self._check_open()
            data, reboot = bytes(self._inbox), self._reboot
            self._inbox.clear()
            self._reboot = False
        return data, reboot

    def _check_open(self) -> None:
        if self._closed:
            raise SourceError("the twin has been switched off", where=self.name)


def open_twin(argument: str, skin: Skin) -> TwinTransport:
    """``twin``, or with options, joined by commas: ``twin:seed=3,noise=2``.

    ``seed=N``: of noise, spread and temperature. ``fast``: no waiting. ``preset=NAME``: another
    material and board than the skin file's. ``noise=LSB``: of one conversion. ``board=NAME``, or
    the name alone: the speed, the limits and the converter of a board of the table.

    Raises
    ------
    SourceError
        For an unknown option or value.
    """
    options = read_options(argument, ("seed", "fast", "preset", "noise", "board", *BOARDS), "twin")
    settings = read_settings(options, skin, "twin")
    if "noise" in options:
        settings = settings.with_noise(_noise(options["noise"]))
    pace = 0.0 if "fast" in options else 1.0
    board = read_board(options, "twin")
    return make_twin(skin, settings, WallClock(), pace, None if board is None else BOARDS[board])


def read_settings(options: Mapping[str, str], skin: Skin, where: str) -> TwinSettings:
    """The twin's settings by the options ``seed`` and ``preset``, else 0 and the skin's preset.

    Raises SourceError that names ``where`` for a value that is neither.
    """
    seed = options.get("seed", "0")
    if not (seed.isascii() and seed.isdigit()):
        raise SourceError(f'expected a seed of 0 or more, got "{seed}"', where=where)
    preset = options.get("preset", skin.twin.preset)
    if preset not in PRESETS:
        raise SourceError(no_such(preset, PRESETS, "a preset"), where=where)
    return TwinSettings.preset(preset, int(seed))


def read_board(options: Mapping[str, str], where: str) -> str | None:
    """The board that ``board=NAME``, or its name alone, stands for; None where there is none.

    Raises SourceError that names ``where``.
    """
    names = {options["board"]} if "board" in options else set()
    names |= {name for name in BOARDS if name in options}
    if len(names) > 1:
        raise SourceError(f"expected one board, got {' and '.join(sorted(names))}", where=where)
    for name in names - BOARDS.keys():
        raise SourceError(no_such(name, BOARDS, "a board"), where=where)
    return next(iter(names), None)


def make_twin(
    skin: Skin,
    settings: TwinSettings,
    clock: Clock,
    pace: float = 1.0,
    record: BoardRecord | None = None,
) -> TwinTransport:
    """A twin that takes its time from ``clock``; ``pace`` 0 does not wait between frames.

    Its board is that of a ``record``; without one, a simulated board with the converter that the
    skin file names.
    """
    n, number = skin.n_electrodes, b"twin" + (settings.seed % 2**32).to_bytes(4, "big")
    if record is not None:
        board = Board.of(record, n, skin.current, number)
    else:
        board = Board(
            channels=next((size for size in _CHANNELS if size >= n), n),
            adc_bits=skin.readout.adc_bits,
            current=skin.current,
            tick_rate=skin.readout.tick_rate,
            unique_id=number,
        )
    electronics = make_electronics(skin, settings, board.adc_bits)
    device = TwinDevice(electronics, board, clock.now(), pace)
    return TwinTransport(electronics, device, clock, Line(settings.line, settings.seed))


def make_electronics(skin: Skin, settings: TwinSettings, adc_bits: int = 0) -> TwinElectronics:
    """Sheet and electronics of a twin, without the board's firmware and the wire.

    For scripts that need the counts only: ``set_presses`` on its ``sheet``, then ``sample``. The
    converter has ``adc_bits``, or those of the skin file where these are more.
    """
    settings = settings.with_electrodes(skin.twin.electrodes)
    sheet = TwinSkin.of(skin, settings)
    readout, noise = on_converter(skin.readout, settings.electronics.noise, adc_bits)
    electronics = replace(settings.electronics, noise=noise)
    return TwinElectronics(sheet, readout, skin.current, electronics, settings.seed)


class Scans:
    """Scan after scan of a twin's ``electronics``, without the board's firmware and the wire."""

    def __init__(self, skin: Skin, settings: TwinSettings) -> None:
        self.electronics = make_electronics(skin, settings)
        self.scan = Scan.of(skin.pattern())
        self.table = table_of(self.scan, ScanSettings.of(skin))
        self._tick_rate = skin.readout.tick_rate

    def renew(self, chance: np.random.SeedSequence) -> None:
        """Begin again at time 0, with an untouched sheet; noise and temperature from ``chance``."""
        of_sheet, of_board = chance.spawn(2)
        self.electronics.sheet.renew(of_sheet)
        self.electronics.renew(of_board)

    def frame(self, number: int, time: float) -> Frame:
        """The frame ``number`` of a scan begun at ``time`` s."""
        samples, sums = self.table.readings(self.electronics.sample(self.table, time))
        ticks = round(time * self._tick_rate)
        return Frame(number % 2**32, ticks, time, 0, 0, 0, samples, sums)


def on_converter(
    readout: ReadoutSettings, noise: float, adc_bits: int
) -> tuple[ReadoutSettings, float]:
    """The read-out and its ``noise``, LSB, with a finer converter: as noisy in volts."""
    bits = max(adc_bits, readout.adc_bits)
    return replace(readout, adc_bits=bits), noise * (1 << bits - readout.adc_bits)


def _noise(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 1e6:  # NaN fails too
        raise SourceError(f'expected a noise of 0 LSB or more, got "{text}"', where="twin")
    return value
