"""Sections of a skin file → outline, surface, electrodes and pattern that go together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Self, get_type_hints

import numpy as np

from tomoskin.core import DIMENSIONS, FloatArray, GeometryError, PatternError, SkinError, located
from tomoskin.model import mesh as meshes
from tomoskin.model.pattern import Pattern, named
from tomoskin.model.section import Section
from tomoskin.model.skin import body, processing
from tomoskin.model.skin.kept_mesh import kept_mesh

FORMAT = 1
"""Version of the file that this code reads, the top-level key ``format``."""

OFF_RIM = 0.01
"""A position may miss the rim by half an electrode, and by this part of the rim's length."""

_RIM_POINTS = 240

_SAMPLE_BITS = 16
"""A frame carries each sample, the sum over the oversampling, in so many bits."""


@dataclass(frozen=True)
class SkinSections:
    """The sections of a skin file, in the order in which they are written."""

    skin: body.NameSection
    outline: body.OutlineSection
    surface: body.SurfaceSection
    electrodes: body.ElectrodesSection
    material: body.MaterialSection
    drive: body.DriveSection
    readout: body.ReadoutSettings
    mesh: processing.MeshSettings
    inverse: processing.InverseSettings
    signal: processing.SignalSettings
    touch: processing.TouchSettings
    twin: processing.TwinChoice


SECTIONS: dict[str, type[Section]] = get_type_hints(SkinSections)
"""Every section by its name, in that order."""

BODY = frozenset({"outline", "surface", "electrodes", "drive"})
"""Sections that a :class:`SkinBody` is made of."""


@dataclass(frozen=True, eq=False)
class SkinBody:
    """What is made of the sections :data:`BODY`.

    ``contact_impedance`` is (n,) per electrode, Ω·m.
    """

    outline: meshes.Outline
    surface: meshes.Surface
    arcs: tuple[meshes.ElectrodeArc, ...]
    contact_impedance: FloatArray
    pattern: Pattern

    @classmethod
    def of(cls, sections: SkinSections, source: str) -> Self:
        """Raises SkinError that names ``source`` and section where parts do not go together."""
        with located(f"{source}: [outline]", SkinError, GeometryError):
            outline = _outline(sections.outline)
        with located(f"{source}: [electrodes]", SkinError, GeometryError):
            arcs = _arcs(outline, sections.electrodes)
            meshes.check_arcs(outline, arcs)
        with located(f"{source}: [surface]", SkinError, GeometryError):
            surface = _surface(sections.surface, Path(source).parent)
            surface.check(outline.polyline(outline.length / _RIM_POINTS))
        impedance = _impedances(sections.electrodes, len(arcs), source)
        with located(f"{source}: [drive]", SkinError, PatternError):
            pattern = _pattern(sections.drive, len(arcs))
        return cls(outline, surface, arcs, impedance, pattern)


def check_readout(readout: body.ReadoutSettings, source: str) -> None:
    """Raise SkinError for sums that do not fit into a frame's samples."""
    most = (2**_SAMPLE_BITS - 1) // (2**readout.adc_bits - 1)
    if readout.oversampling > most:
        raise SkinError(
            f"expected at most {most} at {readout.adc_bits} bits, got {readout.oversampling}",
            where=f"{source}: [readout] oversampling",
            hint=f"a sample is the sum of its readings and must fit in {_SAMPLE_BITS} bits",
        )


@lru_cache(maxsize=16)
def flat_mesh(
    outline: body.OutlineSection, electrodes: body.ElectrodesSection, mesh: processing.MeshSettings
) -> meshes.Mesh:
    """The sheet of these sections, laid flat; equal skins of a process share it, and it is kept on
    disk.

    Raises GeometryError when the electrodes cannot be resolved with so few cells.
    """
    rim = _outline(outline)
    arcs = _arcs(rim, electrodes)
    wanted = f"{outline!r} {electrodes!r} {mesh.cells}"
    return kept_mesh(wanted, lambda: meshes.triangulate(rim, arcs, mesh.cells))


def _outline(given: body.OutlineSection) -> meshes.Outline:
    match given:
        case body.OutlineSection(diameter=float(diameter)):
            return meshes.Disc(diameter / 2)
        case body.OutlineSection(shape="ellipse", width=float(width), height=float(height)):
            return meshes.Ellipse(width / 2, height / 2)
        case body.OutlineSection(width=float(width), height=float(height)):
            return meshes.Rectangle(width, height)
        case _:
            return meshes.Polygon(np.array(given.vertices))


def _surface(given: body.SurfaceSection, folder: Path) -> meshes.Surface:
    if given.radius is not None and (given.layer or 0.0) >= given.radius:
        raise GeometryError(
            f"expected a layer thinner than the radius, {1e3 * given.radius:.4g} mm, since it lies "
            f"within the body; got {1e3 * (given.layer or 0.0):.4g} mm"
        )
    match given:
        case body.SurfaceSection(shape="cylinder", radius=float(radius)):
            return meshes.Cylinder(radius, given.axis)
        case body.SurfaceSection(shape="cap", radius=float(radius)):
            return meshes.Cap(radius)
        case body.SurfaceSection(radius_x=float(x), radius_y=float(y)):
            return meshes.Saddle(x, y)
        case body.SurfaceSection(radius=float(radius), joint=float(joint)):
            return meshes.Arm(radius, given.bend, joint)
        case body.SurfaceSection(file=str(file)):
            return meshes.Draped.read(folder / file, scale=DIMENSIONS["length"][given.unit])
        case _:
            return meshes.Plane()


def _arcs(
    outline: meshes.Outline, given: body.ElectrodesSection
) -> tuple[meshes.ElectrodeArc, ...]:
    """Electrodes, E1 first. Raises GeometryError that names the one that is off the rim."""
    if given.count is None:
        centres = _on_rim(outline, np.array(given.positions), given.width)
    else:
        step = outline.length / given.count
        turn = -1 if given.order == "clockwise" else 1
        centres = np.float64(outline.toward(given.first)) + turn * step * np.arange(given.count)
    return tuple(
        meshes.ElectrodeArc.around(float(s) % outline.length, given.width) for s in centres
    )


def _on_rim(outline: meshes.Outline, positions: FloatArray, width: float) -> FloatArray:
    s = outline.nearest(positions)
    gap = np.linalg.norm(outline.point(s) - positions, axis=1)
    allowed = min(width / 2, OFF_RIM * outline.length)
    if (gap > allowed).any():
        number = int(np.argmax(gap > allowed))
        x, y = positions[number] * 1e3
        raise GeometryError(
            f"expected a position on the rim within {allowed * 1e3:.3g} mm, "
            f"got ({x:.4g}, {y:.4g}) mm, {gap[number] * 1e3:.3g} mm off",
            where=f"E{number + 1}",
        )
    return s


def _impedances(given: body.ElectrodesSection, n_electrodes: int, source: str) -> FloatArray:
    values = given.contact_impedance
    if len(values) not in (1, n_electrodes):
        raise SkinError(
            f"expected one value or {n_electrodes}, one per electrode, got {len(values)}",
            where=f"{source}: [electrodes] contact_impedance",
        )
    result = np.array(np.broadcast_to(values, n_electrodes), dtype=float)
    result.flags.writeable = False
    return result


def _pattern(given: body.DriveSection, n_electrodes: int) -> Pattern:
    """The file's own tables, or the named pattern."""
    if given.drive is not None and given.measure is not None:
        return Pattern.from_tables(given.drive, given.measure, n_electrodes)
    return named(given.pattern, n_electrodes)
