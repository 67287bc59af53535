"""A script's text → what happens on the sheet, and when; strict. Whether it can be run on a skin is
said before it begins."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Self

import numpy as np

from tomoskin.board.source import Configuration, ScanSettings
from tomoskin.core import GeometryError, ScriptError, SkinError, located
from tomoskin.model.pattern import Scan
from tomoskin.model.section import toml_tables
from tomoskin.model.skin import Skin
from tomoskin.twin import course, script_schema as schema
from tomoskin.twin.bend import strain_of
from tomoskin.twin.presets import TwinSettings
from tomoskin.twin.probe import Circle, Face, Finger, Shape, Square

_DEFAULT_SOURCE = "script"


@dataclass(frozen=True)
class Script:
    """A timeline of presses, faults and marks.

    Attributes
    ----------
    source
        Path of the file, for messages.
    name
        For people.
    duration, lead_in
        s; all times count from the end of the lead-in.
    seed
        Of all noise.
    presses, faults, marks, bends
        In the file's order.
    preset
        Name of the twin's settings; None for the skin's own.
    """

    source: str
    name: str
    duration: float
    lead_in: float
    seed: int
    presses: tuple[course.ScriptedPress, ...]
    faults: tuple[course.Scripted[schema.FaultSection], ...]
    marks: tuple[course.Scripted[schema.MarkSection], ...]
    preset: str | None = None
    bends: tuple[course.ScriptedBend, ...] = ()

    @classmethod
    def from_toml(cls, text: str, *, source: str = _DEFAULT_SOURCE) -> Self:
        """Script from its text; ``source`` names it in errors.

        Raises
        ------
        ScriptError
            For a key that is not known or missing, or a value that cannot be meant. Whether the
            whole can be run on a skin, :func:`check_script` says.
        """
        with located("", ScriptError, SkinError):
            tables = toml_tables(text, source, schema.FORMAT, schema.SECTIONS)
            head = schema.ScriptSection.read(tables.get("script", {}), f"{source}: [script]")
            presses = tuple(_press(s, w) for s, w in schema.PressSection.each(tables, source))
            faults = tuple(_fault(s, w) for s, w in schema.FaultSection.each(tables, source))
            marks = tuple(course.Scripted(s, w) for s, w in schema.MarkSection.each(tables, source))
            bends = [
                course.ScriptedBend.of(s, w) for s, w in schema.BendSection.each(tables, source)
            ]
            bends += [
                course.ScriptedBend.of(s, w) for s, w in schema.StretchSection.each(tables, source)
            ]
        return cls(
            source,
            presses=presses,
            faults=faults,
            marks=marks,
            bends=tuple(bends),
            **vars(head),
        )


def _press(given: schema.PressSection, where: str) -> course.ScriptedPress:
    force = course.there_and_back(given, given.force, where)
    path = course.after((0.0, *given.at), given.path, f"{where} path")
    return course.ScriptedPress(given, where, _shape(given, where), force, path)


def _shape(given: schema.PressSection, where: str) -> Shape:
    crown = given.crown or math.inf
    match given:
        case schema.PressSection(radius=float(radius)):
            return Circle(radius, crown)
        case schema.PressSection(side=float(side)):
            return Square(side, crown)
        case schema.PressSection(vertices=None):
            return Finger(given.length, given.width)
    with located(f"{where} vertices", ScriptError, GeometryError):
        return Face(given.vertices or (), crown)


def _fault(given: schema.FaultSection, where: str) -> course.Scripted[schema.FaultSection]:
    if given.end is not None and not given.end > given.start:
        raise ScriptError(
            f"expected a time after start, {given.start:g} s, got {given.end:g} s",
            where=f"{where} end",
            hint="times count from the end of the lead-in, not from start",
        )
    if given.other is not None and given.other == given.electrode:
        raise ScriptError(
            f"expected an electrode other than E{given.electrode + 1}, got the same",
            where=f"{where} other",
            hint="an electrode is always connected to itself",
        )
    return course.Scripted(given, where)


_LEFT = 0.01
"""Part of a step that may be left when the first sample is read: as much as the sheet's own
spread and the mesh leave unknown."""

_ROUNDING = 1e-9
"""Times that differ by less, s, are the same."""


def check_script(script: Script, skin: Skin) -> None:
    """Raise ScriptError for a script that cannot be run on ``skin``.

    Two presses of one id at once, something after the end, a probe off the skin, an electrode that
    is not there, a stage that no frame would show, a board that reads before it has settled.
    """
    check_settling(skin, script.preset or skin.twin.preset)
    _check_ids(script.presses)
    _check_ends(script)
    scan = Configuration.of(Scan.of(skin.pattern()), ScanSettings.of(skin))
    if script.duration < scan.scan_time:
        raise ScriptError(
            f"expected at least one frame of this skin, {1e3 * scan.scan_time:.3g} ms, "
            f"got {1e3 * script.duration:g} ms",
            where=f"{script.source}: [script] duration",
            hint="make it longer, or shorten [readout] settling of the skin",
        )
    course.check_stages(script.presses, scan.scan_time)
    _check_faults(script, skin, scan.scan_time)
    for press in script.presses:
        press.check_on(skin.outline)
    _check_bends(script, skin)


def _check_bends(script: Script, skin: Skin) -> None:
    """Each by itself, as far as it goes, at points all over the skin."""
    height = TwinSettings.preset(script.preset or skin.twin.preset).bend.height
    rim = skin.outline.polyline(skin.outline.length / 64)
    middle = skin.outline.centre
    points = np.concatenate([middle + part * (rim - middle) for part in (0.0, 0.5, 1.0)])
    for bend in script.bends:
        with located(bend.where, ScriptError, GeometryError):
            for _, amount in bend.course:
                strain_of((bend.shape(amount),), points, skin.surface, height)


def check_settling(skin: Skin, preset: str) -> None:
    """Raise ScriptError where the board of ``preset`` reads a skin before it has settled.

    A drive's potentials are reached exponentially, with the board's time constant; what is left
    of the step from the drive before is exp(−settling/τ).
    """
    tau = TwinSettings.preset(preset).electronics.time_constant
    waits = ScanSettings.of(skin).settling
    least = -tau * math.log(_LEFT)
    if waits < least:
        rest = math.exp(-waits / tau)
        raise ScriptError(
            f"expected at least {1e6 * least:.0f} us, got {1e6 * waits:.0f} us: the "
            f"{preset} board settles with a time constant of {1e6 * tau:.0f} us, and "
            f"{100 * rest:.0f} % of each sample would come from the drive before",
            where=f"{skin.source}: [readout] settling",
            hint="make it longer, or choose another preset",
        )


def _check_faults(script: Script, skin: Skin, frame_time: float) -> None:
    for fault in script.faults:
        lasts = fault.given.stop - fault.given.start
        if 0 < lasts < frame_time:
            raise ScriptError(
                f"it lasts {1e3 * lasts:g} ms, shorter than a frame of this "
                f"skin, {1e3 * frame_time:.3g} ms",
                where=f"{fault.where} end",
                hint=course.NO_FRAME,
            )
        for key in ("electrode", "other"):
            electrode = getattr(fault.given, key)
            if electrode is not None and electrode >= skin.n_electrodes:
                raise ScriptError(
                    "expected an electrode from 0 (E1) to "
                    f"{skin.n_electrodes - 1}, got {electrode}",
                    where=f"{fault.where} {key}",
                )


def _check_ids(presses: tuple[course.ScriptedPress, ...]) -> None:
    for first, second in combinations(presses, 2):
        start = first.given.start
        together = min(first.end, second.end) > max(start, second.given.start) + _ROUNDING
        if first.given.id == second.given.id and together:
            raise ScriptError(
                f'"{first.given.id}" already presses from {start:g} s to {first.end:g} s',
                where=f"{second.where} id",
                hint="two presses at once need different ids",
            )


def _check_ends(script: Script) -> None:
    lasting: list[course.ScriptedPress | course.ScriptedBend] = [*script.presses, *script.bends]
    last = [(one.end, one.where, "it to end by") for one in lasting]
    last += [
        (one.given.stop, f"{one.where} {'end' if one.given.end else 'start'}", "at most")
        for one in script.faults
    ]
    last += [(mark.given.at, f"{mark.where} at", "at most") for mark in script.marks]
    for time, where, what in last:
        if time > script.duration + _ROUNDING:
            raise ScriptError(
                f"expected {what} {script.duration:g} s, got {time:g} s",
                where=where,
                hint="raise [script] duration",
            )
