"""The skin: one sensor sheet with its electrodes, drive, readout and settings."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from typing import Any, Self

import numpy as np

from tomoskin.core import FloatArray, GeometryError, SkinError, located
from tomoskin.model.mesh import ElectrodeArc, Mesh, Outline, Surface, laid_on
from tomoskin.model.pattern import Pattern
from tomoskin.model.section import Document, check_names, toml_tables, toml_text
from tomoskin.model.skin import processing
from tomoskin.model.skin.body import ReadoutSettings
from tomoskin.model.skin.build import (
    BODY,
    FORMAT,
    SECTIONS,
    SkinBody,
    SkinSections,
    check_readout,
    flat_mesh,
)
from tomoskin.model.skin.find import built_in_names, skin_text
from tomoskin.model.skin.symmetry import Ambiguity, SheetSymmetry, unseen_symmetries

_BODY = ("outline", "surface", "electrodes", "material", "drive", "readout", "mesh", "twin")
"""Sections that sheet, mesh and scan rest on; the others only make images of it."""


@dataclass(frozen=True, eq=False)
class Skin:
    """A sensor sheet as its file describes it, in SI units.

    Attributes
    ----------
    source
        Path of the file, or "built-in".
    document
        Sections and keys as written, defaults filled in.
    name, description
        For people.
    outline, arcs
        Rim of the sheet, and the stretch of it that each electrode covers.
    surface
        What the sheet lies on.
    layer
        Thickness of the soft layer under the sheet, m; None where the file does not say it.
    conductivity
        Sheet conductance of the unloaded sheet, S.
    gauge, gauge_across
        How its resistance rises with mean strain, and with the deviator; None where not known.
    contact_impedance
        (n,) per electrode, Ω·m.
    current
        Driven current, A.
    mesh_cells
        Wanted number of triangles.
    readout, inverse, signal, touch, twin
        Settings of the rooms of that name.
    """

    source: str
    document: Document = field(repr=False)
    name: str
    description: str
    outline: Outline
    arcs: tuple[ElectrodeArc, ...]
    surface: Surface
    layer: float | None
    conductivity: float
    gauge: float | None
    gauge_across: float | None
    contact_impedance: FloatArray
    current: float
    mesh_cells: int
    readout: ReadoutSettings
    inverse: processing.InverseSettings
    signal: processing.SignalSettings
    touch: processing.TouchSettings
    twin: processing.TwinChoice
    _body: SkinBody = field(repr=False)
    _sections: SkinSections = field(repr=False)

    @classmethod
    def load(cls, skin: str | PathLike[str]) -> Self:
        """Built-in skin of that name, or the skin file at that path.

        Raises
        ------
        SkinError
            For an unknown name, a file that cannot be read, or a value that cannot be meant;
            the message names file, section, key and the allowed range.
        """
        text, source = skin_text(skin)
        return cls.from_toml(text, source=source)

    @classmethod
    def from_toml(cls, text: str, *, source: str = "skin") -> Self:
        """Skin from the text of a skin file; ``source`` names it in errors."""
        written = toml_tables(text, source, FORMAT, SECTIONS)
        document, records = _read({name: written.get(name, {}) for name in SECTIONS}, source)
        sections = SkinSections(**records)
        return cls._of(document, sections, SkinBody.of(sections, source), source)

    @staticmethod
    def names() -> tuple[str, ...]:
        """Names of the built-in skins."""
        return built_in_names()

    def altered(self, changes: Mapping[str, Mapping[str, Any]], *, source: str = "") -> Self:
        """This skin with other values, as a file would write them: ``{"mesh": {"cells": 300}}``.

        A value of None takes the key out. ``source`` is the file that it will be, if another.
        """
        source = source or self.source
        check_names(changes, list(SECTIONS), "section", source)
        written = {name: {**self.document[name], **keys} for name, keys in changes.items()}
        document, records = _read(
            {
                name: {key: value for key, value in keys.items() if value is not None}
                for name, keys in written.items()
            },
            source,
        )
        sections = replace(self._sections, **records)
        kept = source == self.source and not BODY & changes.keys()
        body = self._body if kept else SkinBody.of(sections, source)
        return self._of({**self.document, **document}, sections, body, source)

    @property
    def body(self) -> dict[str, Any]:
        """Sections of the document that sheet, mesh and scan rest on.

        Skins whose bodies are equal differ in what is made of their voltages only.
        """
        return {name: self.document[name] for name in _BODY}

    @property
    def n_electrodes(self) -> int:
        """The number of electrodes of the skin."""
        return len(self.arcs)

    @property
    def polarity(self) -> float:
        """Sign of the measured voltages: −1 where they come reversed."""
        return -1.0 if self._sections.drive.polarity == "reversed" else 1.0

    @property
    def chop_frequency(self) -> float:
        """Of an alternating drive, Hz; 0 where the drive is direct."""
        drive = self._sections.drive
        return drive.chop_frequency if drive.mode == "chopped" else 0.0

    @cached_property
    def electrode_centres(self) -> FloatArray:
        """(n, 2) middle of each electrode on the rim, m."""
        middle = [arc.start + arc.width(self.outline) / 2 for arc in self.arcs]
        return self.outline.point(np.array(middle))

    @cached_property
    def identity(self) -> str:
        """Short hash of everything but name, description, source and twin."""
        content = {
            name: {key: getattr(getattr(self._sections, name), key) for key in keys}
            for name, keys in self.document.items()
            if name not in ("skin", "twin")
        }
        return hashlib.sha256(_canonical(content).encode()).hexdigest()[:16]

    def pattern(self) -> Pattern:
        """Drive and measurement table."""
        return self._body.pattern

    @cached_property
    def unseen_symmetries(self) -> tuple[SheetSymmetry, ...]:
        """Symmetries of sheet and electrodes that leave every row of the pattern as it is."""
        return unseen_symmetries(self.pattern(), self.outline, self.electrode_centres)

    def ambiguity(self, jacobian: Callable[[], FloatArray]) -> Ambiguity | None:
        """Which places the pattern cannot tell apart; None where it tells all.

        ``jacobian`` makes that of the pattern on :meth:`mesh`, (n_meas, n_cells): most patterns see
        every symmetry, and then it is not asked.
        """
        if not self.unseen_symmetries:
            return None
        centres = self.electrode_centres
        return Ambiguity.of(self.unseen_symmetries, self.outline, centres, self.mesh(), jacobian())

    def mesh(self) -> Mesh:
        """Mesh of the sheet in its own coordinates, with the lengths it has on its surface; made
        once.

        Raises SkinError when the electrodes cannot be resolved with so few cells.
        """
        return self._mesh

    def to_toml(self) -> str:
        """Text of a skin file that gives this skin again, defaults written out."""
        return toml_text(self.document, SECTIONS.values(), FORMAT)

    @cached_property
    def _mesh(self) -> Mesh:
        given = self._sections
        with located(f"{self.source}: [mesh] cells", SkinError, GeometryError):
            flat = flat_mesh(given.outline, given.electrodes, given.mesh)
        with located(f"{self.source}: [surface]", SkinError, GeometryError):
            return laid_on(flat, self.surface)

    @classmethod
    def _of(cls, document: Document, sections: SkinSections, body: SkinBody, source: str) -> Self:
        check_readout(sections.readout, source)
        return cls(
            source=source,
            document=document,
            name=sections.skin.name,
            description=sections.skin.description,
            outline=body.outline,
            arcs=body.arcs,
            surface=body.surface,
            layer=sections.surface.layer,
            conductivity=1.0 / sections.material.sheet_resistance,
            gauge=sections.material.gauge,
            gauge_across=sections.material.gauge_across,
            contact_impedance=body.contact_impedance,
            current=sections.drive.current,
            mesh_cells=sections.mesh.cells,
            readout=sections.readout,
            inverse=sections.inverse,
            signal=sections.signal,
            touch=sections.touch,
            twin=sections.twin,
            _body=body,
            _sections=sections,
        )


def _read(written: Mapping[str, object], source: str) -> tuple[Document, dict[str, Any]]:
    """Sections as written with their defaults, and their records."""
    positions = {
        name: f"{source}: {SECTIONS[name].heading}" for name in SECTIONS if name in written
    }
    document = {
        name: SECTIONS[name].complete(written[name], place) for name, place in positions.items()
    }
    return document, {
        name: SECTIONS[name].read(document[name], positions[name]) for name in document
    }


def _canonical(content: Document) -> str:
    """Text that is the same for the same values, however their units were written."""

    def plain(value: object) -> object:
        if isinstance(value, float):
            return f"{value:.12g}"
        if isinstance(value, tuple):
            return [plain(item) for item in value]
        return value

    return json.dumps(
        {s: {k: plain(v) for k, v in keys.items()} for s, keys in content.items()}, sort_keys=True
    )
