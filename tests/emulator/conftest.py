"""The real ELF and the emulator, built once; without their tools tests are skipped, loudly."""

from __future__ import annotations

import pytest

from firmware.boards import built
from firmware.conftest import need
from tomoskin.emulator import Programs


@pytest.fixture(scope="session")
def programs() -> Programs:
    need(["make", "cc", "avr-gcc", "simavr"], "gcc-avr avr-libc simavr libsimavr-dev")
    return Programs(built("avr", "tomoskin-16.elf"), built("emulator", "tomoskin-emulator"))
