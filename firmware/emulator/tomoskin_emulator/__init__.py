"""The board's real firmware on a simulated processor, before the twin's sheet."""

from tomoskin_emulator.flash import (
    check_current as check_current,
    read_identity as read_identity,
    say_board as say_board,
    say_identity as say_identity,
    sense_resistor as sense_resistor,
    settings_uf2 as settings_uf2,
    write_firmware as write_firmware,
    write_identity as write_identity,
    write_uf2 as write_uf2,
)
from tomoskin_emulator.program import build_firmware as build_firmware
from tomoskin_emulator.source import (
    EmulatorTransport as EmulatorTransport,
    emulate_board as emulate_board,
    emulate_load as emulate_load,
)
