"""``tomoskin firmware``: flash it, say what board it is on, build it, run it in the emulator."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from tomoskin.cli.app import group
from tomoskin.cli.choices import quantity
from tomoskin.cli.options import DEFAULT_SKIN, NamedSkinOption
from tomoskin.cli.output import Bar

app = group("firmware")


def _eight_bytes(name: str | None) -> str | None:
    if name is not None and not (name.isascii() and name.isprintable() and 0 < len(name) <= 8):
        raise typer.BadParameter(f'expected 1 to 8 ASCII characters, got "{name}"')
    return name


Channels = Annotated[
    int, typer.Option(help="Number of the board's channels: 8 or 16, on a Pico also 32.")
]


def _checked_board(board: str) -> str:
    if board not in ("mega", "pico"):
        raise typer.BadParameter(f'expected mega or pico, got "{board}"')
    return board


Board = Annotated[
    str,
    typer.Option(
        help="mega (Arduino Mega 2560) or pico (Raspberry Pi Pico).", callback=_checked_board
    ),
]


def _check_channels(channels: int, board: str) -> None:
    from tomoskin.twin.emulator import BOARDS

    kind = BOARDS[board]
    if channels not in kind.channels:
        wanted = ", ".join(map(str, kind.channels[:-1])) + f" or {kind.channels[-1]}"
        other = "; a Pico has up to 32: --board pico" if channels == 32 else ""
        raise typer.BadParameter(f"expected {wanted} channels ({kind.text}), got {channels}{other}")


@app.command()
def build(channels: Channels = 8, board: Board = "mega") -> None:
    """Build the firmware of a board: the ELF of an ATmega2560, the UF2 of a Pico."""
    from tomoskin.twin.emulator import build_elf, build_uf2

    _check_channels(channels, board)
    with Bar("building"):
        made = build_uf2(channels) if board == "pico" else build_elf(channels)
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
    board: Board = "mega",
) -> None:
    """Write the firmware to a board: to a Mega with avrdude, to a Pico's boot drive as UF2."""
    from tomoskin.twin.emulator import find_boot_drive, pico_image, write_firmware, write_uf2

    _check_channels(channels, board)
    if board == "mega" and port is None:
        raise typer.BadParameter("expected the port of the board, such as /dev/ttyACM0, got none")
    with Bar("writing"):
        if board == "mega":
            assert port is not None
            write_firmware(port, channels)
        else:
            drive = find_boot_drive() if port is None else Path(port)
            write_uf2(pico_image(channels), drive)
            port = str(drive)
    after = (
        "next: tomoskin firmware configure" if board == "mega" else ("the Pico starts it by itself")
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
    board: Board = "mega",
) -> None:
    """Write a board's current and id into its EEPROM and read them back; without either, show
    them and the board's name. Of a Pico the current alone is written, to its flash."""
    from tomoskin.model.skin import Skin
    from tomoskin.twin.emulator import (
        check_current,
        read_identity,
        say_board,
        say_identity,
        write_identity,
    )

    asked = None if current is None else quantity(current, "current", "--current")
    of_skin = Skin.load(skin).current if skin else None
    if asked is not None:
        check_current(asked, of_skin)
    if board == "pico":
        _configure_pico(Path(port), asked, name)
        return
    held = read_identity(port)
    if asked is None and name is None:
        typer.echo(f"{port}: {say_board(held)}")
        return
    identity = held.change(asked, name)
    check_current(identity.current, of_skin)
    with Bar("writing"):
        write_identity(port, identity)
    typer.echo(f"{port}: {say_identity(identity)}, read back from the firmware")
    _say_resistor(identity.current)


def _configure_pico(drive: Path, current: float | None, name: str | None) -> None:
    from tomoskin.twin.emulator import settings_uf2, write_uf2

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
    from tomoskin.twin.emulator import sense_resistor

    ohms = f"{sense_resistor(current):.4g} Ω"
    typer.echo(
        f"the firmware cannot measure the current: the sense resistor must have {ohms} in total"
    )


@app.command()
def emulate(skin: NamedSkinOption = DEFAULT_SKIN, board: Board = "mega") -> None:
    """Run the firmware on a simulated board until Ctrl-C; its serial port is printed."""
    from tomoskin.model.skin import Skin
    from tomoskin.twin.emulator import emulate_board

    with emulate_board(Skin.load(skin), board) as process:
        typer.echo(process.port)
        try:
            while process.alive:
                time.sleep(0.2)
        except KeyboardInterrupt:
            pass
