"""``tomoskin firmware``: flash it, say what board it is on, build it, run it in the emulator."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from tomoskin.board.source import BOARDS, DEFAULT_BOARD, BoardRecord
from tomoskin.cli import DEFAULT_SKIN, Bar, NamedSkinOption, group, quantity
from tomoskin.core import no_such

app = group("firmware", "Build, flash and emulate the board's firmware.")


def _eight_bytes(name: str | None) -> str | None:
    if name is not None and not (name.isascii() and name.isprintable() and 0 < len(name) <= 8):
        raise typer.BadParameter(f'expected 1 to 8 ASCII characters, got "{name}"')
    return name


def _numbers(channels: tuple[int, ...]) -> str:
    """The numbers as people list them, such as "8, 16 or 32"."""
    *others, most = map(str, channels)
    return f"{', '.join(others)} or {most}" if others else most


_SIZES = "; ".join(f"{_numbers(board.channels)} ({name})" for name, board in BOARDS.items())
Channels = Annotated[int, typer.Option(help=f"Number of the board's channels: {_SIZES}.")]


def _checked_board(board: str) -> str:
    if board not in BOARDS:
        raise typer.BadParameter(no_such(board, BOARDS))
    return board


Board = Annotated[
    str,
    typer.Option(
        help=f"{' or '.join(f'{name} ({board.text})' for name, board in BOARDS.items())}.",
        callback=_checked_board,
    ),
]


def _record(board: str, channels: int) -> BoardRecord:
    """The record of a board whose firmware is built for so many channels."""
    record = BOARDS[board]
    if channels not in record.channels:
        wanted = _numbers(record.channels)
        more = [name for name, other in BOARDS.items() if channels in other.channels]
        other = f"; a {BOARDS[more[0]].text} has them: --board {more[0]}" if more else ""
        raise typer.BadParameter(
            f"expected {wanted} channels ({record.text}), got {channels}{other}"
        )
    return record


@app.command()
def build(channels: Channels = 8, board: Board = DEFAULT_BOARD) -> None:
    """Build the firmware of a board: the ELF of an ATmega2560, the UF2 of a Pico."""
    from tomoskin_emulator import build_firmware

    record = _record(board, channels)
    with Bar("building"):
        made = build_firmware(record, channels)
    typer.echo(str(made))


@app.command()
def flash(
    port: Annotated[
        str | None,
        typer.Argument(
            help="Port of the board, such as /dev/ttyACM0. For a Pico, its boot drive; without it "
            "the drive is searched for."
        ),
    ] = None,
    channels: Channels = 8,
    board: Board = DEFAULT_BOARD,
) -> None:
    """Write the firmware to a board: to a Mega with avrdude, to a Pico's boot drive as UF2."""
    from tomoskin_emulator import write_firmware

    record = _record(board, channels)
    if record.flash == "avrdude" and port is None:
        raise typer.BadParameter("expected the port of the board, such as /dev/ttyACM0, got none")
    with Bar("writing"):
        port = write_firmware(record, channels, port)
    after = (
        f"the {record.text} starts it by itself"
        if record.flash == "uf2"
        else "next: tomoskin firmware configure"
    )
    typer.echo(f"{port}: firmware for {channels} channels; {after}")


@app.command()
def configure(
    port: Annotated[
        str,
        typer.Argument(help="Such as /dev/ttyACM0; to write to a Pico its boot drive: see flash."),
    ],
    current: Annotated[
        str | None,
        typer.Option(
            metavar="CURRENT", help='Measured current of the sense resistor, such as "100 mA".'
        ),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            "--id",
            metavar="NAME",
            help="Name of this board, at most 8 characters.",
            callback=_eight_bytes,
        ),
    ] = None,
    skin: Annotated[
        str | None,
        typer.Option(help="Built-in name or path. A current above that of this skin is refused."),
    ] = None,
    board: Board = DEFAULT_BOARD,
) -> None:
    """Write a board's current and id into its EEPROM and read them back; without either, show
    them and the board's name. Of a Pico the current alone is written, to its flash."""
    import tomoskin_emulator as emulator
    from tomoskin.model.skin import Skin

    asked = None if current is None else quantity(current, "current", "--current")
    of_skin = Skin.load(skin).current if skin else None
    if asked is not None:
        emulator.check_current(asked, BOARDS[board], of_skin)
    if BOARDS[board].flash == "uf2":
        _configure_pico(Path(port), asked, name)
        return
    held = emulator.read_identity(port)
    if asked is None and name is None:
        typer.echo(f"{port}: {emulator.say_board(held)}")
        return
    if asked is None and held.damaged:
        raise typer.BadParameter(
            f"expected --current too: the board holds {emulator.say_identity(held)}"
        )
    identity = held.change(asked, name)
    emulator.check_current(identity.current, BOARDS[board], of_skin)
    with Bar("writing"):
        emulator.write_identity(BOARDS[board], port, identity)
    typer.echo(f"{port}: {emulator.say_identity(identity)}, read back from the firmware")
    _say_resistor(identity.current)


def _configure_pico(drive: Path, current: float | None, name: str | None) -> None:
    from tomoskin_emulator import settings_uf2, write_uf2

    if name is not None:
        raise typer.BadParameter("the id of a Pico is its flash chip's, and cannot be changed")
    if current is None:
        raise typer.BadParameter(
            "expected --current; tomoskin firmware configure PORT shows what a Pico holds"
        )
    write_uf2(settings_uf2(current), drive)
    typer.echo(f"{drive}: {current * 1e3:g} mA; the Pico starts again with it")
    _say_resistor(current)


def _say_resistor(current: float) -> None:
    from tomoskin_emulator import sense_resistor

    ohms = f"{sense_resistor(current):.4g} Ω"
    typer.echo(
        f"the firmware cannot measure the current: the sense resistor must have {ohms} in total"
    )


@app.command()
def emulate(skin: NamedSkinOption = DEFAULT_SKIN, board: Board = DEFAULT_BOARD) -> None:
    """Run the firmware on a simulated board until Ctrl-C; its serial port is printed."""
    from tomoskin.model.skin import Skin
    from tomoskin_emulator import emulate_board

    with emulate_board(Skin.load(skin), board) as process:
        typer.echo(process.port)
        try:
            while process.alive:
                time.sleep(0.2)
        except KeyboardInterrupt:
            pass
