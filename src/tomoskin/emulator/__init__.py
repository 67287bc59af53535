"""The board's real firmware on a simulated processor, before the twin's sheet."""

from tomoskin.emulator.process import BoardProcess, Front, SkinMemory
from tomoskin.emulator.program import Programs, build_elf, build_programs
from tomoskin.emulator.transport import EmulatorTransport, emulate_board

__all__ = [
    "BoardProcess",
    "EmulatorTransport",
    "Front",
    "Programs",
    "SkinMemory",
    "build_elf",
    "build_programs",
    "emulate_board",
]
