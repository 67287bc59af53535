"""``tomoskin firmware``: build it, flash it, run it in the emulator."""

from __future__ import annotations

import shutil
import subprocess
import time
from typing import Annotated

import typer

from tomoskin.cli.app import group
from tomoskin.cli.options import DEFAULT_SKIN, NamedSkinOption
from tomoskin.cli.output import Bar

app = group("firmware")


def _known(channels: int) -> int:
    if channels not in (8, 16):
        raise typer.BadParameter(f"expected 8 or 16, got {channels}")
    return channels


Channels = Annotated[int, typer.Option(help="8 or 16, as the board has.", callback=_known)]


@app.command()
def build(channels: Channels = 16) -> None:
    """Build the firmware of an ATmega2560 board."""
    from tomoskin.emulator import build_elf

    with Bar("building"):
        elf = build_elf(channels)
    typer.echo(str(elf))


@app.command()
def flash(
    port: Annotated[str, typer.Argument(help="Such as /dev/ttyACM0.")], channels: Channels = 16
) -> None:
    """Build the firmware and write it to an Arduino Mega 2560 with avrdude."""
    from tomoskin.core import SourceError
    from tomoskin.emulator import build_elf

    if shutil.which("avrdude") is None:
        raise SourceError(
            "avrdude is missing", where="firmware flash", hint="on Debian: apt-get install avrdude"
        )
    with Bar("building"):
        elf = build_elf(channels)
    command = ["avrdude", "-p", "atmega2560", "-c", "wiring", "-b", "115200", "-D", "-P", port]
    if subprocess.run([*command, "-U", f"flash:w:{elf}:e"], check=False).returncode:
        raise SourceError(
            "avrdude could not write the firmware", where=port, hint="is it the board's port?"
        )


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
