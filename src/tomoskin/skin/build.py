"""Checks between keys: values of a skin file → geometry, pattern and readout."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from tomoskin.core import FloatArray, GeometryError, PatternError, SkinError
from tomoskin.mesh import ElectrodeArc, Outline, Surface, check_arcs
from tomoskin.pattern import Pattern, named
from tomoskin.skin.place import arcs_of, outline_of, surface_of
from tomoskin.skin.read import Document
from tomoskin.skin.settings import ReadoutSettings

_RIM_POINTS = 240

_SAMPLE_BITS = 16
"""A frame carries each sample, the sum over the oversampling, in so many bits."""


@contextmanager
def located(place: str) -> Iterator[None]:
    """Turn errors of the rooms above into errors of the skin file, at ``place``."""
    try:
        yield
    except (GeometryError, PatternError) as error:
        where = f"{place}, {error.where}" if error.where else place
        raise SkinError(error.message, where=where, hint=error.hint) from error


def placed(value: Document, source: str) -> tuple[Outline, tuple[ElectrodeArc, ...]]:
    """Outline and electrodes, which must have room on it."""
    with located(f"{source}: [outline]"):
        outline = outline_of(value["outline"])
    with located(f"{source}: [electrodes]"):
        arcs = arcs_of(outline, value["electrodes"])
        check_arcs(outline, arcs)
    return outline, arcs


def laid(value: Document, outline: Outline, source: str) -> Surface:
    """What the sheet lies on, which must have room for it."""
    with located(f"{source}: [surface]"):
        surface = surface_of(value["surface"], Path(source).parent)
        surface.check(outline.polyline(outline.length / _RIM_POINTS))
    return surface


def impedances(value: Document, n_electrodes: int, source: str) -> FloatArray:
    """(n,) contact impedance of each electrode, Ω·m."""
    given = value["electrodes"]["contact_impedance"]
    if len(given) not in (1, n_electrodes):
        raise SkinError(
            f"expected one value or {n_electrodes}, one per electrode, got {len(given)}",
            where=f"{source}: [electrodes] contact_impedance",
        )
    result = np.array(np.broadcast_to(given, n_electrodes), dtype=float)
    result.flags.writeable = False
    return result


def pattern_of(value: Document, n_electrodes: int, source: str) -> Pattern:
    """The named pattern, or the one of the file's own tables."""
    drive = value["drive"]
    with located(f"{source}: [drive]"):
        if "pattern" in drive:
            return named(drive["pattern"], n_electrodes)
        return Pattern.from_tables(drive["drive"], drive["measure"], n_electrodes)


def readout_of(value: Document, source: str) -> ReadoutSettings:
    """Readout whose sums fit into a frame's samples."""
    readout = ReadoutSettings(**value["readout"])
    most = (2**_SAMPLE_BITS - 1) // (2**readout.adc_bits - 1)
    if readout.oversampling > most:
        raise SkinError(
            f"expected at most {most} at {readout.adc_bits} bits, got {readout.oversampling}",
            where=f"{source}: [readout] oversampling",
            hint=f"a sample is the sum of its readings and must fit in {_SAMPLE_BITS} bits",
        )
    return readout
