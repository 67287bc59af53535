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


def _checked_channels(channels: int) -> int:
    if channels not in (8, 16):
        raise typer.BadParameter(f"expected 8 or 16, got {channels}")
    return channels


def _eight_bytes(name: str | None) -> str | None:
    if name is not None and not (name.isascii() and name.isprintable() and 0 < len(name) <= 8):
        raise typer.BadParameter(f'expected 1 to 8 ASCII characters, got "{name}"')
    return name


Channels = Annotated[
    int, typer.Option(help="8 or 16, as the board has.", callback=_checked_channels)
]
Port = Annotated[str, typer.Argument(help="Such as /dev/ttyACM0.")]


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


@app.command()
def build(channels: Channels = 8, board: Board = "mega") -> None:
    """Build the firmware of a board: the ELF of an ATmega2560, the UF2 of a Pico."""
    from tomoskin.emulator import build_elf, build_uf2

    with Bar("building"):
        made = build_uf2(channels) if board == "pico" else build_elf(channels)
    typer.echo(str(made))


@app.command()
def flash(
    port: Annotated[
        str | None,
        typer.Argument(
            help="Such as /dev/ttyACM0; of a Pico its boot drive, found where none is named."
        ),
    ] = None,
    channels: Channels = 8,
    board: Board = "mega",
) -> None:
    """Write the firmware to a board: to a Mega with avrdude, to a Pico's boot drive as UF2."""
    from tomoskin.emulator import find_boot_drive, pico_image, write_firmware, write_uf2

    if board == "mega" and port is None:
        raise typer.BadParameter("expected the port of the board, such as /dev/ttyACM0")
    with Bar("writing"):
        if board == "mega":
            assert port is not None
            write_firmware(port, channels)
        else:
            drive = find_boot_drive() if port is None else Path(port)
            write_uf2(pico_image(channels), drive)
            port = str(drive)
    after = "next is tomoskin firmware configure" if board == "mega" else "the Pico starts it"
    typer.echo(f"{port}: firmware for {channels} channels; {after}")


@app.command()
def configure(
    port: Port,
    current: Annotated[
        str | None,
        typer.Option(metavar="CURRENT", help='What the sense resistor gives, measured: "100 mA".'),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            "--id",
            metavar="NAME",
            help="Name of this board, of at most 8 characters.",
            callback=_eight_bytes,
        ),
    ] = None,
    skin: Annotated[
        str | None, typer.Option(help="Built-in name or path: no current above its own.")
    ] = None,
) -> None:
    """Write a board's current and id into its EEPROM and read them back; without either, show
    them."""
    from tomoskin.emulator import (
        check_current,
        read_identity,
        say_identity,
        sense_resistor,
        write_identity,
    )
    from tomoskin.skin import Skin

    asked = None if current is None else quantity(current, "current", "--current")
    of_skin = Skin.load(skin).current if skin else None
    if asked is not None:
        check_current(asked, of_skin)
    held = read_identity(port)
    if asked is None and name is None:
        typer.echo(f"{port}: {say_identity(held)}")
        return
    identity = held.change(asked, name)
    check_current(identity.current, of_skin)
    with Bar("writing"):
        write_identity(port, identity)
    typer.echo(f"{port}: {say_identity(identity)}, read back from the firmware")
    ohms = f"{sense_resistor(identity.current):.4g} Ω"
    typer.echo(f"the firmware cannot measure it: the sense resistor must be {ohms} in all")


@app.command()
def emulate(skin: NamedSkinOption = DEFAULT_SKIN, board: Board = "mega") -> None:
    """Run the firmware on a simulated board until Ctrl-C; its serial port is printed."""
    from tomoskin.emulator import emulate_board
    from tomoskin.skin import Skin

    with emulate_board(Skin.load(skin), board) as process:
        typer.echo(process.port)
        try:
            while process.alive:
                time.sleep(0.2)
        except KeyboardInterrupt:
            pass
