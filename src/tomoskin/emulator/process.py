"""The emulator as a process of its own: its serial port appears, and it ends with its owner."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from tomoskin.core import SourceError
from tomoskin.emulator.program import Programs


class BoardProcess:
    """An emulated board; ``port`` is its serial port."""

    def __init__(
        self, programs: Programs, memory: Path, current: float, *options: str | Path
    ) -> None:
        """Power on. ``memory``: of the skin; ``current`` A: what its limiter is set to.

        ``options``: further ones of the emulator, see ``firmware/emulator/emulator.c``.
        """
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        self._process = subprocess.Popen(
            [
                *(programs.emulator, "-d", "-s", memory, "-c", str(round(current * 1e6))),
                *options,
                programs.elf,
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
        )
        assert self._process.stdout is not None
        self.port = self._process.stdout.readline().decode().strip()
        if not self.port:
            self.close()
            raise SourceError(f"the emulator does not start: {self.last_words}", where="emulator")

    @property
    def alive(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    @property
    def complaints(self) -> str:
        """What the emulator has said of switches that were misused; empty when none were."""
        self._said.seek(0)
        return self._said.read().decode(errors="replace")

    def close(self) -> None:
        """Power off."""
        if self._said.closed:
            return
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        self.last_words = self.complaints.strip()
        self._said.close()
