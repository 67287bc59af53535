"""``tomoskin simulate``: the twin follows a script."""

from __future__ import annotations

import time
from collections import ChainMap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.choices import say_headroom
from tomoskin.cli.named_files import RECORDING, Added, Given, Reads, Writes, added_to
from tomoskin.cli.options import DEFAULT_SKIN, NamedSkinOption, SimulateOptions
from tomoskin.cli.output import Bar, JsonFlag, remark, tell
from tomoskin.core import Output

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin

ADDED: tuple[type[SimulateOptions], ...] = added_to("simulate")
"""What else than a script it may be asked for."""


def _simulated(out: Path | None, given: Given, called: str) -> list[Output]:
    """A session, or what another record of options makes of it."""
    assert out is not None
    others = (record.outputs(out, given, called) for record in ADDED)
    default = [Output(out, RECORDING, called)]
    return next((outputs for outputs in others if outputs is not None), default)


def simulate(
    *,
    skin: NamedSkinOption = DEFAULT_SKIN,
    script: Annotated[
        Path | None,
        typer.Option(metavar="X.toml", help="Script of the presses and faults (docs/simulate.md)."),
        Reads(),
    ] = None,
    out: Annotated[
        Path,
        typer.Option(help="Session file."),
        Writes(dict(ChainMap(RECORDING, *(one.ENDINGS for one in ADDED))), _simulated),
    ],
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="Seed of all noise; it overrides the script's. The same seed gives the same data.",
        ),
    ] = None,
    added: Added,
    json: JsonFlag = False,
) -> None:
    """Check what is asked for, and do it."""
    from tomoskin.model.skin import Skin
    from tomoskin.sensing.signal import Headroom

    chosen = Skin.load(skin)
    say_headroom(Headroom.of_skin(chosen))
    if any(one.run(chosen, script, out, seed, json=json) for one in added):
        return
    if script is None:
        raise typer.BadParameter("expected --script FILE, got none", param_hint="--script")
    _timeline(chosen, script, out, seed, json=json)


def _timeline(skin: Skin, script: Path, out: Path, seed: int | None, *, json: bool) -> None:
    from tomoskin.model.skin import read_text
    from tomoskin.run import simulate as run
    from tomoskin.twin import Script

    read = Script.from_toml(read_text(script, "a script"), source=str(script))
    begun = time.monotonic()
    try:
        with Bar("simulating") as bar:
            made = run(read, skin, out, seed=seed, advance=bar)
    except KeyboardInterrupt:
        remark(f"stopped; {out} holds the simulation until then, and says that it was stopped")
        raise typer.Exit(1) from None
    took = time.monotonic() - begun
    document = {
        "out": str(out), "frames": made.frames, "lost": made.lost, "seconds": made.seconds,
    }  # fmt: skip
    lost = f", {made.lost} lost on the line" if made.lost else ""
    line = f"{out}: {made.frames} frames{lost}, {made.seconds:g} s of the skin in {took:.1f} s"
    tell(document, [line], json=json)
