"""``tomoskin board``: the first power-up of a board, step by step."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.board.source import BOARDS, DEFAULT_BOARD
from tomoskin.cli.app import group
from tomoskin.cli.choices import quantity
from tomoskin.cli.output import JsonFlag, concluded
from tomoskin.core import registered_one

if TYPE_CHECKING:
    from tomoskin.board.source import Transport
    from tomoskin.run import CheckFinding
    from tomoskin.sensing.signal import LoadRing

app = group("board")


MOST = BOARDS[DEFAULT_BOARD].channels[-1]

FIVE = "+5V"
"""The point whose reading is the reference of the Mega's converter."""


@app.callback()
def _board() -> None:
    """Keep ``check`` a word of its own."""


@app.command()
def check(
    source: Annotated[
        str, typer.Option(help="serial:PORT, serial:auto, or emulator to try the procedure.")
    ] = "serial:auto",
    channels: Annotated[
        int, typer.Option(min=4, max=MOST, help="Number of the board's channels.")
    ] = 8,
    current: Annotated[
        str, typer.Option(metavar="CURRENT", help="Current that the sense resistor is made for.")
    ] = "100 mA",
    meter: Annotated[
        bool, typer.Option(help="Ask for the multimeter's readings first; Enter skips one.")
    ] = True,
    five_volts: Annotated[
        float | None,
        typer.Option(
            min=4.5,
            max=5.5,
            metavar="V",
            help="Volts that a meter shows at +5V, where --no-meter does not ask for them.",
        ),
    ] = None,
    json: JsonFlag = False,
) -> None:
    """Check the first power-up: readings of a multimeter, then what the board itself measures.

    The second part needs a ring of resistors at the terminals, 1 Ω each at 100 mA (0.1 V over the
    current). One lies between neighbours, two in parallel from E1 to E2, three from E2 to E3.
    """
    amperes = quantity(current, "current", "--current")
    if not 1e-6 <= amperes <= 0.1:
        raise typer.BadParameter(f"expected 1 µA to 100 mA, got {current}", param_hint="--current")
    read = {} if five_volts is None else {FIVE: five_volts}
    raise concluded(_findings(source, channels, amperes, read, meter=meter), json=json)


def _findings(
    source: str, channels: int, current: float, read: dict[str, float], *, meter: bool
) -> Iterator[CheckFinding]:
    from tomoskin.run import check_board
    from tomoskin.sensing.signal import LoadRing

    if meter:
        yield from _readings(current, channels, read)
    _, _, board = source.partition(":")
    record = BOARDS.get(board, BOARDS[DEFAULT_BOARD])
    ring = LoadRing.for_current(channels, current, record.ring_drop)
    with _opened(source, ring, current) as transport:
        yield from check_board(transport, ring, current, five_volts=read.get(FIVE))


def _readings(current: float, channels: int, read: dict[str, float]) -> Iterator[CheckFinding]:
    """Ask for what only a multimeter can tell; it stands in ``read`` afterwards, V by point."""
    from tomoskin.run import CheckFinding
    from tomoskin.sensing.signal import STAGES, meter_steps

    stage = ""
    for step in meter_steps(current, channels, read):
        if step.stage != stage:
            stage = step.stage
            typer.echo(f"\n{STAGES[stage]}; black lead on GND.", err=True)
        volts = _asked(f"{step.point}, expected {step.expected}")
        if volts is None:
            continue
        read[step.point] = volts
        ok = step.accepts(volts)
        text = f"{step.point}: {volts:g} V"
        yield CheckFinding(
            stage, ok, text if ok else f"{text}, expected {step.expected}: {step.otherwise}"
        )
        if not ok:
            typer.echo("Switch off, find the cause, then start again.", err=True)
            raise typer.Exit(1)


def _asked(question: str) -> float | None:
    """Volts that a person enters; None for Enter alone."""
    while True:
        text = typer.prompt(question, default="", show_default=False, err=True).strip()
        if not text:
            return None
        with contextlib.suppress(ValueError):
            return float(text.removesuffix("V").strip().replace(",", "."))
        typer.echo(f'expected volts, such as 2.20, got "{text}"', err=True)


@contextlib.contextmanager
def _opened(source: str, ring: LoadRing, current: float) -> Iterator[Transport]:
    from tomoskin.board.source import open_source
    from tomoskin.model.skin import Skin

    name, _, argument = source.partition(":")
    if (entry := registered_one("loads", name)) is not None:
        with entry.load()(argument, ring.resistance, current) as transport:
            yield transport
        return
    transport = open_source(source, Skin.load("textile-disc-8"))
    try:
        yield transport
    finally:
        transport.close()
