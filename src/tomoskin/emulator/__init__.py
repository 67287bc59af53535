"""The board's real firmware on a simulated processor, before the twin's sheet."""

from tomoskin.emulator.memory import Front, SkinMemory
from tomoskin.emulator.process import BoardProcess
from tomoskin.emulator.program import Programs, build_elf, build_programs
from tomoskin.emulator.source import emulate_board
from tomoskin.emulator.transport import EmulatorTransport

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
