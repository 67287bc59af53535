"""The board's real firmware on a simulated processor, before the twin's sheet."""

from tomoskin.twin.emulator.flash import (
    check_current,
    read_identity,
    say_board,
    say_identity,
    sense_resistor,
    write_firmware,
    write_identity,
)
from tomoskin.twin.emulator.program import build_firmware
from tomoskin.twin.emulator.source import EmulatorTransport, emulate_board, emulate_load
from tomoskin.twin.emulator.uf2 import settings_uf2, write_uf2

__all__ = [
    "EmulatorTransport",
    "build_firmware",
    "check_current",
    "emulate_board",
    "emulate_load",
    "read_identity",
    "say_board",
    "say_identity",
    "sense_resistor",
    "settings_uf2",
    "write_firmware",
    "write_identity",
    "write_uf2",
]
