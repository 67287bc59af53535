"""The option ``--sink`` of commands that run a pipeline."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from tomoskin.sink import Sink

SinkOption = Annotated[
    list[str] | None,
    typer.Option(
        "--sink",
        metavar="SINK",
        help="Publish results: foxglove:8766, mqtt://HOST:1883/TOPIC, lsl, zenoh, ros2, …",
    ),
]


def chosen_sinks(specs: list[str] | None) -> tuple[Sink, ...]:
    """The sinks that were asked for, not opened; SinkError for one that cannot be meant."""
    from tomoskin.sink import make_sink

    return tuple(make_sink(spec) for spec in specs or ())
