"""``tomoskin firmware``: flash it, say what board it is on, build it, run it in the emulator."""

from __future__ import annotations

import time
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


@app.command()
def build(channels: Channels = 8) -> None:
    """Build the firmware of an ATmega2560 board."""
    from tomoskin.emulator import build_elf

    with Bar("building"):
        elf = build_elf(channels)
    typer.echo(str(elf))


@app.command()
def flash(port: Port, channels: Channels = 8) -> None:
    """Write the firmware to an Arduino Mega 2560 with avrdude."""
    from tomoskin.emulator import write_firmware

    with Bar("writing"):
        write_firmware(port, channels)
    typer.echo(f"{port}: firmware for {channels} channels; next is tomoskin firmware configure")


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
            help="Tells this board from others; at most 8 characters.",
            callback=_eight_bytes,
        ),
    ] = None,
    skin: Annotated[
        str | None, typer.Option(help="Built-in name or path: no current above its own.")
    ] = None,
) -> None:
    """Write a board's current and id into its EEPROM, read them back; without either, say them."""
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
def emulate(skin: NamedSkinOption = DEFAULT_SKIN) -> None:
    """Run the firmware on a simulated ATmega2560 until Ctrl-C; its serial port is printed."""
    from tomoskin.emulator import emulate_board
    from tomoskin.skin import Skin

    with emulate_board(Skin.load(skin)) as board:
        typer.echo(board.port)
        try:
            while board.alive:
                time.sleep(0.2)
        except KeyboardInterrupt:
            pass
