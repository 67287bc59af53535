"""The script of the twin, declared once: reading, errors and documentation follow."""

from __future__ import annotations

from typing import Any

from tomoskin.skin import (
    Choice,
    Number,
    OneOrSpan,
    Quantity,
    Row,
    Section,
    Table,
    Text,
    Whole,
    Words,
    key,
)
from tomoskin.twin.presets import PRESETS

FORMAT = 1
"""Version of the file that this code reads, the top-level key ``format``."""

_PRESET = Choice(tuple(PRESETS))
_PRESET_MEANING = "The twin's material and board, instead of the skin's own."
_TIME = Quantity("time", "s", 0, 86400)
_LASTS = Quantity("time", "s", 0, 3600)
_FORCE = Quantity("force", "N", 0, 1000)
_SIZE = Quantity("length", "mm", 0.5, 1000)
_LENGTH = Quantity("length", "mm", -5000, 5000)
_GAP = Quantity("length", "mm", 0, 1000)
_LIMB = Quantity("length", "mm", 1, 10_000)
_POINT = Row({"x": _LENGTH, "y": _LENGTH})
_ANGLE = Quantity("angle", "deg", -360, 360)
_STRAIN = Number(-0.5, 1.0)
_ELECTRODE = Whole(0, 31)

Course = tuple[tuple[Any, ...], ...]
"""Rows of a time and values, as written."""


def _course(**values: Quantity | Number) -> Table:
    return Table(Row({"time": _TIME, **values}), ascending=True)


class ScriptSection(Section, section="script"):
    """The whole. Time 0 is the end of the lead-in; all other times count from there."""

    name: str = key(Text(), "One line for people.", default="")
    duration: float = key(Quantity("time", "s", 0.01, 86400), "From time 0 to the end.")
    lead_in: float = key(_LASTS, "Idle time before time 0, for the reference.", default="1 s")
    seed: int = key(Whole(0, 2**31 - 1), "Of all noise; --seed wins over it.", default=0)
    preset: str | None = key(_PRESET, _PRESET_MEANING, default=None)


class PressSection(Section, section="press", many=True):
    """A probe pressed on the sheet. It stands from `start` on for as long as its force lasts."""

    id: str = key(Text(), "Name; two presses at once must differ in it.")
    shape: str = key(
        Choice(("circle", "square", "finger", "polygon")), "Face of the probe.", default="circle"
    )
    radius: float | None = key(_SIZE, "Of the circle.", shape="circle")
    side: float | None = key(_SIZE, "Of the square.", shape="square")
    length: float = key(_SIZE, "Of the fingertip.", default="22 mm", shape="finger")
    width: float = key(_SIZE, "Of the fingertip.", default="16 mm", shape="finger")
    vertices: Course | None = key(
        Table(_POINT, 3), "Corners around the middle of the probe.", shape="polygon"
    )
    crown: float | None = key(
        Quantity("length", "mm", 1, 100_000),
        "Radius of curvature of a face that is not flat; that of a ball is its radius.",
        default=None,
        shape=("circle", "square", "polygon"),
    )
    angle: float = key(_ANGLE, "By which the face is turned, counter-clockwise.", default="0 deg")
    at: tuple[Any, ...] = key(_POINT, "Where its middle stands first.")
    path: Course | None = key(
        _course(x=_LENGTH, y=_LENGTH),
        "Sliding: positions of the middle at times since `start`, from `at` on in straight lines.",
        default=None,
    )
    motion: str = key(
        Choice(("slide", "roll")),
        "How it follows its path: by its friction it drags the sheet along.",
        default="slide",
    )
    start: float = key(_TIME, "When it touches the sheet.")
    force: float | None = key(_FORCE, "Force while it is held.", unless="profile")
    rise: float = key(_LASTS, "From 0 to the force, evenly.", default="200 ms", unless="profile")
    hold: float | None = key(_LASTS, "At the force.", unless="profile")
    fall: float = key(_LASTS, "From the force to 0, evenly.", default="200 ms", unless="profile")
    profile: Course | None = key(
        _course(force=_FORCE),
        "Instead of these: force at times since `start`, from 0 N to 0 N in straight lines.",
        default=None,
    )


class _Bending(Section):
    """When a sheet is bent or stretched."""

    start: float = key(_TIME, "When it begins.")
    rise: float = key(
        _LASTS, "Until all of it is reached, evenly.", default="1 s", unless="profile"
    )
    hold: float | None = key(_LASTS, "For which it stays.", unless="profile")
    fall: float = key(_LASTS, "Until none is left, evenly.", default="1 s", unless="profile")


class BendSection(_Bending, section="bend", many=True):
    """The sheet is bent, and is straight again at the end. Several at once add up."""

    kind: str = key(
        Choice(("hinge", "joint")),
        "hinge: along a strip, flat on both sides. joint: around a limb with a joint, as "
        "[surface] of a skin does.",
        default="hinge",
    )
    length: float = key(
        _LIMB,
        "Width of the strip, or length of the limb's middle line over which it bends.",
    )
    axis: float = key(
        _ANGLE,
        "Direction of the strip, from x counter-clockwise.",
        default="90 deg",
        kind="hinge",
    )
    offset: float = key(
        _LENGTH,
        "Of the strip's middle line from the middle of the sheet, to the right as seen along "
        "the axis.",
        default="0 mm",
        kind="hinge",
    )
    radius: float | None = key(_LIMB, "Of the limb.", kind="joint")
    angle: float | None = key(
        _ANGLE, "How far; positive where the front becomes convex.", unless="profile"
    )
    profile: Course | None = key(
        _course(angle=_ANGLE),
        "Instead of these: angle at times since `start`, from 0 to 0 deg in straight lines.",
        default=None,
    )


class StretchSection(_Bending, section="stretch", many=True):
    """The sheet is stretched evenly, and is as long as it was at the end."""

    strain: float | None = key(_STRAIN, "Relative elongation: 0.05 is 5 %.", unless="profile")
    across: float = key(Number(-1, 1), "Elongation across the axis, per that along it.", default=0)
    axis: float = key(_ANGLE, "Direction, from x counter-clockwise.", default="0 deg")
    profile: Course | None = key(
        _course(strain=_STRAIN),
        "Instead of these: elongation at times since `start`, from 0 to 0 in straight lines.",
        default=None,
    )


_LASTING = ("cut", "short", "rail", "noise", "loss", "corruption", "delay")


class FaultSection(Section, section="fault", many=True):
    """Something that goes wrong: a wire is `cut`, two electrodes touch (`short`), a channel stands
    at its `rail`, the converter is noisy (`noise`), bytes are lost (`loss`), altered
    (`corruption`) or late (`delay`), the board loses its power (`reboot`), it gets warmer
    (`temperature`)."""

    kind: str = key(Choice((*_LASTING, "reboot", "temperature")), "Which.")
    start: float = key(_TIME, "When it begins.")
    end: float | None = key(_TIME, "When it is mended.", kind=_LASTING)
    electrode: int | None = key(_ELECTRODE, "Whose, counted from 0.", kind=("cut", "short", "rail"))
    other: int | None = key(_ELECTRODE, "The one that it touches.", kind="short")
    lsb: float | None = key(Number(0, 1000), "Standard deviation of one conversion.", kind="noise")
    probability: float | None = key(
        Number(0, 0.999),
        "Of each byte; for a delay, of each read.",
        kind=("loss", "corruption", "delay"),
    )
    kelvin: float | None = key(
        Number(-100, 100), "Step of the sheet's temperature.", kind="temperature"
    )


class MarkSection(Section, section="mark", many=True):
    """A note in the recording."""

    at: float = key(_TIME, "When.")
    text: str = key(Text(), "What.")


class PressesSection(Section, section="presses"):
    """Instead of a timeline: what labelled frames are drawn from, each frame on its own
    (`--presses N`). Ranges are drawn from evenly."""

    count: tuple[int, int] = key(OneOrSpan(Whole(0, 8)), "Presses at once.", default=1)
    shapes: tuple[str, ...] = key(
        Words(Choice(("circle", "square", "finger"))),
        "Faces, one as likely as another.",
        default="circle",
    )
    size: tuple[float, float] = key(
        OneOrSpan(_SIZE),
        "Radius of a circle, half the side of a square or the length of a fingertip; "
        "rounded to 0.5 mm.",
    )
    force: tuple[float, float] = key(OneOrSpan(_FORCE), "Force of each press.")
    hold: float = key(
        Quantity("time", "s", 0.01, 3600),
        "How long it has been pressed: the sheet creeps.",
        default="1 s",
    )
    margin: float = key(_GAP, "The middle of a probe stays that far from the rim.", default="5 mm")
    apart: float = key(_GAP, "The middles of two probes stay that far apart.", default="40 mm")
    preset: str | None = key(_PRESET, _PRESET_MEANING, default=None)


SECTIONS: dict[str, type[Section]] = {
    one.section: one
    for one in (
        ScriptSection,
        PressSection,
        BendSection,
        StretchSection,
        FaultSection,
        MarkSection,
        PressesSection,
    )
}
"""Every section by its name, in the order of the documentation."""
