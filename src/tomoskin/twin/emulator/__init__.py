"""The board's real firmware on a simulated processor, before the twin's sheet."""

from tomoskin.twin.emulator.board_process import (
    BoardFaults,
    BoardProcess,
    BoardPrograms,
    Front,
    OwnVoltages,
    SkinMemory,
)
from tomoskin.twin.emulator.flash import (
    check_current,
    read_identity,
    say_board,
    say_identity,
    sense_resistor,
    write_firmware,
    write_identity,
)
from tomoskin.twin.emulator.program import PicoPrograms, Programs, build_firmware, programs_of
from tomoskin.twin.emulator.source import EmulatorTransport, emulate_board, emulate_load
from tomoskin.twin.emulator.uf2 import find_boot_drive, settings_uf2, write_uf2

__all__ = [
    "BoardFaults",
    "BoardProcess",
    "BoardPrograms",
    "EmulatorTransport",
    "Front",
    "OwnVoltages",
    "PicoPrograms",
    "Programs",
    "SkinMemory",
    "build_firmware",
    "check_current",
    "emulate_board",
    "emulate_load",
    "find_boot_drive",
    "programs_of",
    "read_identity",
    "say_board",
    "say_identity",
    "sense_resistor",
    "settings_uf2",
    "write_firmware",
    "write_identity",
    "write_uf2",
]
