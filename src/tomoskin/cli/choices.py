"""What the shared options mean: the skin, what of it is changed, what it is prepared with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from tomoskin.cli.options import DEFAULT_SKIN
from tomoskin.cli.output import remark
from tomoskin.core import parse_quantity

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin
    from tomoskin.pipeline import Prepared
    from tomoskin.run.sinks import Sink
    from tomoskin.sensing.signal import Headroom


def skin_for_source(skin: str | None, source: str) -> Skin:
    """The skin named, or the one in the session that ``source`` replays, or the default."""
    from tomoskin.files.session import parse_replay
    from tomoskin.model.skin import Skin

    name, _, argument = source.partition(":")
    if name == "replay":
        return skin_for_file(skin, parse_replay(argument)[0])
    return Skin.load(DEFAULT_SKIN if skin is None else skin)


def skin_if_any(skin: str | None, path: Path) -> Skin | None:
    """The skin named, or the one in the session ``path``; None where neither says one."""
    from tomoskin.files.imports import is_session

    return skin_for_file(skin, path) if skin is not None or is_session(path) else None


def skin_for_file(skin: str | None, path: Path) -> Skin:
    """The skin named, or the one in the session ``path``, or the default."""
    from tomoskin.files.imports import is_session
    from tomoskin.files.session import SessionReader
    from tomoskin.model.skin import Skin

    chosen = None if skin is None else Skin.load(skin)
    if not is_session(path):
        return chosen or Skin.load(DEFAULT_SKIN)
    with SessionReader(path) as session:
        own = session.skin
    if chosen is not None and (others := _sheet_differences(own, chosen)):
        remark(
            f"{path} was recorded on {own.name}, but {chosen.name} has another {', '.join(others)}"
        )
    return chosen or own


def _sheet_differences(one: Skin, other: Skin) -> list[str]:
    """Sections in which the sheets, and the currents through them, differ."""
    sections = ("outline", "surface", "electrodes", "material", "drive")
    return [name for name in sections if one.document[name] != other.document[name]]


def say_headroom(headroom: Headroom) -> None:
    """Say on stderr what is beyond the board, where something is."""
    if headroom.problem is not None:
        remark(headroom.problem)


def quantity(text: str, dimension: str, option: str) -> float:
    """The value of an ``option`` in SI units."""
    try:
        return parse_quantity(text, dimension)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=option) from None


def chosen_sinks(specs: list[str] | None) -> tuple[Sink, ...]:
    """The sinks that were asked for, not opened; SinkError for one that cannot be meant."""
    from tomoskin.run.sinks import make_sink

    return tuple(make_sink(spec) for spec in specs or ())


def with_recorded_calibrations(prepared: Prepared, path: Path) -> Prepared:
    """The skin with those that were on where ``path`` is a session; else as it is."""
    from tomoskin.files.imports import is_session
    from tomoskin.files.session import SessionReader, recorded_calibrations

    if is_session(path):
        with SessionReader(path) as session:
            for calibration in recorded_calibrations(session):
                prepared = prepared.calibrated(calibration)
    return prepared
