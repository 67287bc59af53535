"""The board's real firmware on a simulated processor, before the twin's sheet."""

from tomoskin.twin.emulator.flash import (
    BoardIdentity,
    check_current,
    read_identity,
    say_board,
    say_identity,
    sense_resistor,
    write_firmware,
    write_identity,
)
from tomoskin.twin.emulator.pico import (
    PicoPrograms,
    build_pico_programs,
    build_uf2,
    find_boot_drive,
    pico_image,
    settings_uf2,
    write_uf2,
)
from tomoskin.twin.emulator.process import (
    BoardFaults,
    BoardProcess,
    BoardPrograms,
    Front,
    OwnVoltages,
    SkinMemory,
)
from tomoskin.twin.emulator.program import Programs, build_elf, build_programs, firmware_image
from tomoskin.twin.emulator.source import BOARDS, DEFAULT, BoardKind, emulate_board, emulate_load
from tomoskin.twin.emulator.transport import EmulatorTransport

__all__ = [
    "BOARDS",
    "DEFAULT",
    "BoardFaults",
    "BoardIdentity",
    "BoardKind",
    "BoardProcess",
    "BoardPrograms",
    "EmulatorTransport",
    "Front",
    "OwnVoltages",
    "PicoPrograms",
    "Programs",
    "SkinMemory",
    "build_elf",
    "build_pico_programs",
    "build_programs",
    "build_uf2",
    "check_current",
    "emulate_board",
    "emulate_load",
    "find_boot_drive",
    "firmware_image",
    "pico_image",
    "read_identity",
    "say_board",
    "say_identity",
    "sense_resistor",
    "settings_uf2",
    "write_firmware",
    "write_identity",
    "write_uf2",
]
