"""The twin as a transport: paced by a clock, computed when it is read."""

from __future__ import annotations

import threading
from dataclasses import replace

from tomoskin.core import Clock, SourceError
from tomoskin.twin.bend import Pose
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.electronics import TwinElectronics
from tomoskin.twin.faults import Faults, Line, LineSettings
from tomoskin.twin.probe import Contact
from tomoskin.twin.sheet import TwinSkin


class TwinTransport:
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
        self._line = line or Line(LineSettings(), 0)
        self.name = "twin"
        self.device = device
        self.electronics = electronics
        self._noise: float | None = None
        self._clock = clock
        self._condition = threading.Condition()
        self._inbox = bytearray()
        self._closed = False
        self._reboot = False

    @property
    def sheet(self) -> TwinSkin:
        """The twin's sheet."""
        return self.electronics.sheet

    @property
    def presses(self) -> tuple[Contact, ...]:
        """What presses on the twin now."""
        return self.sheet.presses

    def set_presses(self, presses: tuple[Contact, ...]) -> None:
        """Replace all presses; they show from the next frame on.

        Raises
        ------
        GeometryError
            When the centre of one is off the skin; then nothing is changed.
        """
        self.sheet.set_presses(presses)

    def set_pose(self, pose: Pose) -> None:
        """Bend and stretch the twin's sheet; it shows from the next frame on.

        Raises
        ------
        GeometryError
            When the sheet cannot take that shape; then nothing is changed.
        """
        self.sheet.set_pose(pose)

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
        electronics = self.electronics
        if self._noise is None:
            self._noise = electronics.settings.noise
        value = self._noise if noise is None else noise
        electronics.settings = replace(electronics.settings, noise=value)

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
        """Send ``data`` to the twin."""
        with self._condition:
            self._check_open()
            self._inbox += data
            self._condition.notify()

    def close(self) -> None:
        """Switch the twin off."""
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
