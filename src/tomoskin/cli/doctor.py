"""``tomoskin doctor``: what works here, what does not, and what to do about it."""

from __future__ import annotations

import platform
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Annotated, TypeVar

import typer

from tomoskin import __version__
from tomoskin.cli.output import JsonFlag, concluded
from tomoskin.core import TomoskinError
from tomoskin.run import CheckFinding

_T = TypeVar("_T")


SourceOption = Annotated[
    str | None,
    typer.Option(
        metavar="SOURCE",
        help="Such as serial:PORT. Asks this board too what it has lost since its power came up.",
    ),
]


def doctor(json: JsonFlag = False, source: SourceOption = None) -> None:
    """Say what was found, and exit with 1 where something is not as needed."""
    looks = _LOOKS if source is None else (*_LOOKS, partial(_board, source))
    findings = (finding for look in looks for finding in look())
    raise concluded(findings, json=json, version=__version__)


def _python() -> Iterator[CheckFinding]:
    import numpy as np
    import scipy

    from tomoskin.model.forward import choose_engine

    recent = sys.version_info >= (3, 11)
    yield CheckFinding("python", recent, f"{platform.python_version()} on {platform.platform()}")
    yield CheckFinding("numpy", True, np.__version__)
    yield CheckFinding("scipy", True, scipy.__version__)
    yield _tried("engine", choose_engine, lambda engine: f"{engine.name}: {engine.reason}")


def _page() -> Iterator[CheckFinding]:
    from tomoskin.server import check_page

    yield _tried("page", check_page, lambda _: "built")


def _sources() -> Iterator[CheckFinding]:
    from tomoskin.board.source import list_ports, source_names

    names = ", ".join(source_names())
    yield CheckFinding("sources", bool(names), names or "none: install tomoskin again (make live)")
    ports = ", ".join(map(str, list_ports()))
    yield CheckFinding("serial", True, ports or "no serial port is connected")


def _sinks() -> Iterator[CheckFinding]:
    """Which could be opened; a package that is not here is no fault."""
    from tomoskin.run.sinks import example_of, make_sink, sink_names

    for name in sink_names():
        tried = _tried("sink", partial(make_sink, example_of(name)), lambda _: "installed")
        yield replace(tried, text=f"{name}: {tried.text}", optional=True)


def _skins() -> Iterator[CheckFinding]:
    from tomoskin.model.skin import Skin

    for name in Skin.names():
        yield _tried("skin", partial(Skin.load, name), lambda skin: skin.name)


def _port() -> Iterator[CheckFinding]:
    from tomoskin.server import DEFAULT_PORT, listen

    try:
        listen("127.0.0.1", DEFAULT_PORT).close()
    except TomoskinError as error:
        yield CheckFinding("port", True, str(error))
    else:
        yield CheckFinding("port", True, f"{DEFAULT_PORT} is free")


def _board(source: str) -> Iterator[CheckFinding]:
    """What the board behind ``source`` has lost; its electrodes get no current."""
    from tomoskin.board.source import ask_losses, open_source
    from tomoskin.model.skin import Skin

    try:
        transport = open_source(source, Skin.load("textile-disc-8"))
        try:
            lost = ask_losses(transport)
        finally:
            transport.close()
    except TomoskinError as error:
        yield CheckFinding("board", False, str(error))
        return
    if lost is None:
        text = "its firmware does not count what it loses: tomoskin firmware flash"
        yield CheckFinding("board", True, text)
        return
    text = (
        f"since its power came up, samples were late {lost.conversions} times, and bytes from a "
        f"host were lost {lost.bytes} times"
    )
    yield CheckFinding("board", not (lost.conversions or lost.bytes), text)


def _tried(name: str, look: Callable[[], _T], say: Callable[[_T], str]) -> CheckFinding:
    try:
        return CheckFinding(name, True, say(look()))
    except TomoskinError as error:
        return CheckFinding(name, False, str(error))


_LOOKS = (_python, _page, _sources, _sinks, _skins, _port)
