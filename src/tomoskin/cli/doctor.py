"""``tomoskin doctor``: what works here, what does not, and what to do about it."""

from __future__ import annotations

import platform
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from typing import TypeVar

import typer

from tomoskin import __version__
from tomoskin.cli.output import JsonFlag, tell
from tomoskin.core import TomoskinError

_T = TypeVar("_T")


_EXAMPLES = {"mqtt": "mqtt://127.0.0.1/tomoskin"}
"""Of sinks that want to know where to."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What was looked at: whether it is there, and a sentence; ``optional``: it need not be."""

    name: str
    ok: bool
    text: str
    optional: bool = False

    @property
    def mark(self) -> str:
        """What stands before it."""
        if self.ok:
            return "ok"
        return "-" if self.optional else "FAIL"


def doctor(json: JsonFlag = False) -> None:
    """Say what was found, and exit with 1 where something is not as needed."""
    findings = [finding for look in _LOOKS for finding in look()]
    healthy = all(finding.ok or finding.optional for finding in findings)
    document = {"ok": healthy, "version": __version__, "findings": [asdict(f) for f in findings]}
    lines = (f"{f.mark:<4}  {f.name:<10} {f.text}" for f in findings)
    tell(document, lines, json=json)
    raise typer.Exit(0 if healthy else 1)


def _python() -> Iterator[Finding]:
    import numpy as np
    import scipy

    from tomoskin.model.forward import choose_engine

    recent = sys.version_info >= (3, 11)
    yield Finding("python", recent, f"{platform.python_version()} on {platform.platform()}")
    yield Finding("numpy", True, np.__version__)
    yield Finding("scipy", True, scipy.__version__)
    yield _tried("engine", choose_engine, lambda engine: f"{engine.name}: {engine.reason}")


def _page() -> Iterator[Finding]:
    from tomoskin.server import check_page

    yield _tried("page", check_page, lambda _: "built")


def _sources() -> Iterator[Finding]:
    from tomoskin.board.source import list_ports, source_names

    names = ", ".join(source_names())
    yield Finding("sources", bool(names), names or "none: install tomoskin again (make live)")
    ports = ", ".join(map(str, list_ports()))
    yield Finding("serial", True, ports or "no serial port is connected")


def _sinks() -> Iterator[Finding]:
    """Which could be opened; a package that is not here is no fault."""
    from tomoskin.run.sinks import make_sink, sink_names

    for name in sink_names():
        spec = _EXAMPLES.get(name, name)
        tried = _tried("sink", partial(make_sink, spec), lambda _: "installed")
        yield Finding("sink", tried.ok, f"{name}: {tried.text}", optional=True)


def _skins() -> Iterator[Finding]:
    from tomoskin.model.skin import Skin

    for name in Skin.names():
        yield _tried("skin", partial(Skin.load, name), lambda skin: skin.name)


def _port() -> Iterator[Finding]:
    from tomoskin.server import DEFAULT_PORT, listen

    try:
        listen("127.0.0.1", DEFAULT_PORT).close()
    except TomoskinError as error:
        yield Finding("port", True, str(error))
    else:
        yield Finding("port", True, f"{DEFAULT_PORT} is free")


def _tried(name: str, look: Callable[[], _T], say: Callable[[_T], str]) -> Finding:
    try:
        return Finding(name, True, say(look()))
    except TomoskinError as error:
        return Finding(name, False, str(error))


_LOOKS = (_python, _page, _sources, _sinks, _skins, _port)
