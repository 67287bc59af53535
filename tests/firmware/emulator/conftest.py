"""The real firmware and the emulators, built once; without their tools tests skip, loudly."""

from __future__ import annotations

import pytest

from conftest import missing
from firmware.boards import built
from firmware.conftest import need
from tomoskin.core import SourceError
from tomoskin_emulator.program import PicoPrograms, Programs, programs_of


@pytest.fixture(scope="session")
def programs() -> Programs:
    need(["make", "cc", "avr-gcc", "simavr"], "gcc-avr avr-libc simavr libsimavr-dev")
    return Programs(built("avr", "tomoskin-16.elf"), built("emulator", "tomoskin-emulator"))


@pytest.fixture(scope="session")
def pico() -> PicoPrograms:
    need(["make", "arm-none-eabi-gcc"], "gcc-arm-none-eabi libnewlib-arm-none-eabi")
    try:
        made = programs_of("pico")
    except SourceError as error:
        if "build failed" in str(error):
            raise
        missing(f"the Pico's emulator: {error}")
        raise
    assert isinstance(made, PicoPrograms)
    return made
