"""What a board loses, conversions or bytes of its host, is counted and said.

Each image has a planted mistake that makes it lose something. A second one that hides the loss
must fail the same examination.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from firmware.boards import SCAN, Process, Talk, star_counts
from firmware.emulator.pico import powered, star
from firmware.emulator.test_mutants import mutated as mutated_elf
from firmware.emulator.test_pico import late, mutated as mutated_image
from tomoskin.board.source import SerialTransport
from tomoskin.board.wire import (
    Ack,
    Drive,
    FrameFlag,
    GetLosses,
    Hello,
    Losses,
    Ping,
    Result,
    SetPattern,
    SetScan,
    Start,
)
from tomoskin.core import Frame
from tomoskin_emulator.program import PicoPrograms, Programs

Change = tuple[str, str, str]
PATIENCE, FRAMES = 20.0, 60
LATE: Change = late("hal_delay_us(12u);")
"""So late that six conversions have ended, of which the memory holds four."""
SILENT_PICO: dict[str, Change] = {
    "an overflow that is not read": (
        "pico/converter.c",
        "too_many = (state & FCS_OVER) != 0u || FCS_LEVEL(state) > MOST_WAITING;",
        "too_many = (state & FCS_OVER) != 0u && false;",
    ),
    "an overflow that is not counted": ("pico/converter.c", "        late++;\n", ""),
    "one that no frame says": (
        "src/scan.c",
        "        scan.noticed = (uint8_t)(scan.noticed | FLAG_LATE);\n",
        "",
    ),
}
SILENT_FRONT_END: dict[str, Change] = {
    "words of the channel before": (
        "pico/converter.c",
        "too_many = waited > MOST_WAITING;",
        "too_many = false;\n        waited = 0u;",
    ),
    "no time for the multiplexer": (
        "pico/converter.c",
        "#define DROPPED_OF_FRONT_END 3u",
        "#define DROPPED_OF_FRONT_END 0u",
    ),
}
DEAF: Change = (
    "avr/hal_avr.c",
    "    uint16_t code = ADC;\n",
    "    uint16_t code = ADC;\n    _delay_loop_2(240u);\n",
)
"""60 us in each interrupt of the converter without a look at the line."""
SMALL: Change = ("avr/hal_avr.c", "#define RECEIVE_SIZE 128u", "#define RECEIVE_SIZE 8u")
"""Messages of the host do not fit."""
UNREAD: Change = (
    "src/board.c",
    "    receive();\n",
    "    if (!scan_running() || board.ticks % 64u == 0u) {\n        receive();\n    }\n",
)
COUNTED = "    if (overrun || full) {"
SILENT_MEGA: dict[str, tuple[Change, ...]] = {
    "an overrun that is not read": (
        DEAF,
        ("avr/hal_avr.c", COUNTED, "    if (full || (false && overrun)) {"),
    ),
    "a full ring that is not counted": (
        SMALL,
        UNREAD,
        ("avr/hal_avr.c", COUNTED, "    if (overrun || (false && full)) {"),
    ),
}


def set_up(talk: Talk) -> None:
    talk.next(Hello, PATIENCE)
    drives = tuple(
        Drive(source, sink, mask)
        for (source, sink), mask in zip(SCAN.drives.tolist(), SCAN.masks.tolist(), strict=True)
    )
    half = len(drives) // 2
    for command in (
        SetScan(1, 5, len(drives), 84, 5, 1, 64, 100_000),
        SetPattern(2, 5, 0, drives[:half]),
        SetPattern(3, 5, half, drives[half:]),
        Start(4, 5),
    ):
        for _ in range(20):  # a board that loses bytes is asked again
            talk.say(command)
            try:
                answer = talk.next(Ack, 0.5)
            except AssertionError:
                continue
            assert answer.result is Result.OK
            break


def examine(talk: Talk, flag: FrameFlag, count: Callable[[Losses], int], right: list[int]) -> None:
    """Scan while the host talks: samples are right, some frames say it, the board counts it."""
    set_up(talk)
    frames = []
    for number in range(FRAMES):
        talk.say(Ping(20 + number))
        frames.append(talk.next(Frame, PATIENCE))
    assert all(frame.samples.tolist() == right for frame in frames)
    assert any(frame.flags & flag for frame in frames)
    assert not any(frame.flags & ~(flag | FrameFlag.FIRST | FrameFlag.DROPPED) for frame in frames)
    lost = None
    for number in range(50):
        talk.say(GetLosses(100 + number))
        try:
            lost = talk.next(Losses, 0.5)
        except AssertionError:
            continue
        break
    assert lost is not None
    assert count(lost) > 0


def examine_pico(programs: PicoPrograms, folder: Path, *options: str) -> None:
    with powered(programs, folder, "-f", *options) as board:
        talk = Talk(SerialTransport(board.board.port))
        examine(talk, FrameFlag.LATE, lambda lost: lost.conversions, star(SCAN, 1))
        talk.transport.close()


def examine_mega(programs: Programs, elf: Path, folder: Path) -> None:
    board = Process(programs.emulator, folder / "port", "-f", str(elf))
    talk = Talk(SerialTransport(board.path))
    try:
        examine(talk, FrameFlag.DEAF, lambda lost: lost.bytes, star_counts(1))
    finally:
        talk.transport.close()
        board.kill()
        board.said()


@pytest.mark.parametrize("options", [(), ("-a",)], ids=["own", "front end"])
def test_a_pico_that_is_late_says_so_and_reads_right(
    options: tuple[str, ...], pico: PicoPrograms, tmp_path: Path
) -> None:
    examine_pico(mutated_image(pico, tmp_path, LATE), tmp_path, *options)


@pytest.mark.slow
@pytest.mark.parametrize("name", SILENT_PICO)
def test_a_pico_that_hides_it_is_noticed(name: str, pico: PicoPrograms, tmp_path: Path) -> None:
    planted = mutated_image(pico, tmp_path, LATE, SILENT_PICO[name])
    with pytest.raises(AssertionError):
        examine_pico(planted, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", SILENT_FRONT_END)
def test_a_front_end_that_is_read_wrongly_is_noticed(
    name: str, pico: PicoPrograms, tmp_path: Path
) -> None:
    planted = mutated_image(pico, tmp_path, LATE, SILENT_FRONT_END[name])
    with pytest.raises(AssertionError):
        examine_pico(planted, tmp_path, "-a")


@pytest.mark.parametrize("changes", [(DEAF,), (SMALL, UNREAD)], ids=["overrun", "ring"])
def test_a_mega_that_loses_bytes_says_so(
    changes: tuple[Change, ...], programs: Programs, tmp_path: Path
) -> None:
    examine_mega(programs, mutated_elf([*changes], tmp_path), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", SILENT_MEGA)
def test_a_mega_that_hides_it_is_noticed(name: str, programs: Programs, tmp_path: Path) -> None:
    elf = mutated_elf([*SILENT_MEGA[name]], tmp_path)
    with pytest.raises(AssertionError):
        examine_mega(programs, elf, tmp_path)


def test_the_real_ones_lose_nothing(programs: Programs, pico: PicoPrograms, tmp_path: Path) -> None:
    (tmp_path / "mega").mkdir()
    with pytest.raises(AssertionError, match="any"):
        examine_mega(programs, programs.elf, tmp_path / "mega")
    with pytest.raises(AssertionError, match="any"):
        examine_pico(pico, tmp_path)
