"""Sinks by name, from the entry-point group ``tomoskin.sinks``; the packages that they need."""

from __future__ import annotations

import importlib
from importlib.metadata import entry_points
from typing import Any

from tomoskin.core import SinkError
from tomoskin.sink.sink import Sink

GROUP = "tomoskin.sinks"
"""Entry-point group: each entry is a function ``argument -> Sink`` that does no I/O."""


def sink_names() -> tuple[str, ...]:
    """Names of the installed sinks."""
    return tuple(sorted(entry_points(group=GROUP).names))


def make_sink(spec: str) -> Sink:
    """Sink of ``name`` or ``name:argument``, not opened: ``lsl``, ``mqtt://host/topic``.

    Raises
    ------
    SinkError
        When there is no sink of that name, its argument is none, or its package is missing.
    """
    name, _, argument = spec.partition(":")
    entries = tuple(entry_points(group=GROUP, name=name))
    if not entries:
        raise SinkError(
            f'there is no sink "{name}"', hint=f"known are {', '.join(sink_names()) or 'none'}"
        )
    sink: Sink = entries[0].load()(argument)
    return sink


def needed(module: str, extra: str) -> Any:
    """A module that a sink cannot do without.

    Raises
    ------
    SinkError
        When it is not installed, or cannot be loaded; names the extra that brings it.
    """
    try:
        return importlib.import_module(module)
    except (ImportError, OSError, RuntimeError) as error:
        raise SinkError(
            f"needs {module.partition('.')[0]}: {error}",
            where=f"sink {extra}",
            hint=f"pip install 'tomoskin[{extra}]'",
        ) from error


def port_of(text: str, where: str) -> int:
    """A port number; SinkError where ``text`` is none."""
    if text.isascii() and text.isdigit() and 0 < int(text) < 65536:
        return int(text)
    raise SinkError(f'expected a port from 1 to 65535, got "{text}"', where=where)
