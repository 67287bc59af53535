"""The board's real firmware on a simulated processor, before the twin's sheet."""

from tomoskin.emulator.flash import (
    BoardIdentity,
    check_current,
    read_identity,
    say_identity,
    sense_resistor,
    write_firmware,
    write_identity,
)
from tomoskin.emulator.process import BoardProcess, Front, SkinMemory
from tomoskin.emulator.program import Programs, build_elf, build_programs, firmware_image
from tomoskin.emulator.transport import EmulatorTransport, emulate_board

__all__ = [
    "BoardIdentity",
    "BoardProcess",
    "EmulatorTransport",
    "Front",
    "Programs",
    "SkinMemory",
    "build_elf",
    "build_programs",
    "check_current",
    "emulate_board",
    "firmware_image",
    "read_identity",
    "say_identity",
    "sense_resistor",
    "write_firmware",
    "write_identity",
]
