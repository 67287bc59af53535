"""The script of the twin, declared once: reading, errors and documentation follow."""

from __future__ import annotations

from typing import Any

from tomoskin.model.section import (
    Choice,
    Number,
    Quantity,
    Row,
    Section,
    Table,
    Text,
    Whole,
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
    """The whole script. Time 0 is the end of the lead-in. All other times count from there."""

    name: str = key(Text(), "A title of one line, for people.", default="")
    duration: float = key(
        Quantity("time", "s", 0.01, 86400), "The length of the simulation, from time 0."
    )
    lead_in: float = key(_LASTS, "Idle time before time 0, for the reference.", default="1 s")
    seed: int = key(
        Whole(0, 2**31 - 1), "Seed of all noise. The option --seed replaces it.", default=0
    )
    preset: str | None = key(_PRESET, _PRESET_MEANING, default=None)


def _ramp(meaning: str, default: str) -> float:
    """A time at a constant rate, for which a profile may stand instead."""
    lasts: float = key(_LASTS, meaning, default=default, unless="profile")
    return lasts


class PressSection(Section, section="press", many=True):
    """A probe that presses on the sheet, from `start` until its force has ended."""

    id: str = key(Text(), "Its name. Presses that overlap in time need different names.")
    shape: str = key(
        Choice(("circle", "square", "finger", "polygon")),
        "Shape of the probe's face.",
        default="circle",
    )
    radius: float | None = key(_SIZE, "Radius of the circle.", shape="circle")
    side: float | None = key(_SIZE, "Side of the square.", shape="square")
    length: float = key(_SIZE, "Length of the fingertip.", default="22 mm", shape="finger")
    width: float = key(_SIZE, "Width of the fingertip.", default="16 mm", shape="finger")
    vertices: Course | None = key(
        Table(_POINT, 3), "Corners, relative to the middle of the probe.", shape="polygon"
    )
    crown: float | None = key(
        Quantity("length", "mm", 1, 100_000),
        "Radius of curvature of a face that is not flat. For a ball it is the ball's radius.",
        default=None,
        shape=("circle", "square", "polygon"),
    )
    angle: float = key(_ANGLE, "Rotation of the face, counter-clockwise.", default="0 deg")
    at: tuple[Any, ...] = key(_POINT, "First position of its middle.")
    path: Course | None = key(
        _course(x=_LENGTH, y=_LENGTH),
        "Later positions of its middle, at times since `start`. It moves in straight lines.",
        default=None,
    )
    motion: str = key(
        Choice(("slide", "roll")),
        "How the probe follows its path. Its friction drags the sheet along.",
        default="slide",
    )
    start: float = key(_TIME, "When the probe touches the sheet.")
    force: float | None = key(_FORCE, "Force during `hold`.", unless="profile")
    rise: float = _ramp("Time from 0 N to the force, at a constant rate.", "200 ms")
    hold: float | None = key(_LASTS, "Time at the force.", unless="profile")
    fall: float = _ramp("Time from the force to 0 N, at a constant rate.", "200 ms")
    profile: Course | None = key(
        _course(force=_FORCE),
        "Instead of `force`, `rise`, `hold` and `fall`: force at times since `start`, linear "
        "between the rows. It begins and ends at 0 N.",
        default=None,
    )


class _Bending(Section):
    """When a sheet is bent or stretched."""

    start: float = key(_TIME, "Time at which it begins.")
    rise: float = _ramp("Time until the whole bend or stretch, at a constant rate.", "1 s")
    hold: float | None = key(_LASTS, "Time at the whole bend or stretch.", unless="profile")
    fall: float = _ramp("Time until none of it is left, at a constant rate.", "1 s")


class BendSection(_Bending, section="bend", many=True):
    """A bend of the sheet. At its end the sheet is straight again. Several at once add up."""

    kind: str = key(
        Choice(("hinge", "joint")),
        "A hinge bends the sheet along a strip. Both sides of the strip stay flat. A joint bends "
        "it around a limb with a joint, as `[surface]` of a skin does.",
        default="hinge",
    )
    length: float = key(
        _LIMB,
        "Width of the strip of a hinge. For a joint: length of the limb's middle line that bends.",
    )
    axis: float = key(
        _ANGLE,
        "Direction of the strip, counter-clockwise from x.",
        default="90 deg",
        kind="hinge",
    )
    offset: float = key(
        _LENGTH,
        "Distance of the strip's middle line from the middle of the sheet. It counts to the right "
        "as seen along the axis.",
        default="0 mm",
        kind="hinge",
    )
    radius: float | None = key(_LIMB, "Radius of the limb.", kind="joint")
    angle: float | None = key(
        _ANGLE,
        "Angle of the bend. It is positive where the front becomes convex.",
        unless="profile",
    )
    profile: Course | None = key(
        _course(angle=_ANGLE),
        "Instead of `rise`, `hold`, `fall` and `angle`: angle at times since `start`, linear "
        "between the rows. It begins and ends at 0 deg.",
        default=None,
    )


class StretchSection(_Bending, section="stretch", many=True):
    """An even stretch of the sheet. At its end the sheet has its original length again."""

    strain: float | None = key(_STRAIN, "Relative elongation. 0.05 is 5 %.", unless="profile")
    across: float = key(
        Number(-1, 1), "Elongation across the axis, as a multiple of that along it.", default=0
    )
    axis: float = key(
        _ANGLE, "Direction of the stretch, counter-clockwise from x.", default="0 deg"
    )
    profile: Course | None = key(
        _course(strain=_STRAIN),
        "Instead of `rise`, `hold`, `fall` and `strain`: elongation at times since `start`, linear "
        "between the rows. It begins and ends at 0.",
        default=None,
    )


_LASTING = ("cut", "short", "rail", "noise", "loss", "corruption", "delay")


class FaultSection(Section, section="fault", many=True):
    """A fault. An electrode's wire is broken (`cut`). Two electrodes touch (`short`). A channel
    stands at its `rail`. The converter is noisier (`noise`). Bytes are lost (`loss`), altered
    (`corruption`) or late (`delay`). The board loses its power (`reboot`). The sheet gets warmer
    or colder (`temperature`)."""

    kind: str = key(Choice((*_LASTING, "reboot", "temperature")), "Kind of the fault.")
    start: float = key(_TIME, "When it begins.")
    end: float | None = key(_TIME, "When it ends.", kind=_LASTING)
    electrode: int | None = key(
        _ELECTRODE, "Its electrode, counted from 0: E1 is 0.", kind=("cut", "short", "rail")
    )
    other: int | None = key(_ELECTRODE, "The one that it touches, counted from 0.", kind="short")
    lsb: float | None = key(
        Number(0, 1000), "Standard deviation of one conversion, LSB.", kind="noise"
    )
    probability: float | None = key(
        Number(0, 0.999),
        "Probability for each byte. For a delay: for each read.",
        kind=("loss", "corruption", "delay"),
    )
    kelvin: float | None = key(
        Number(-100, 100), "Step of the sheet's temperature, K.", kind="temperature"
    )

    @property
    def stop(self) -> float:
        """When it ends; its start for what happens at a moment."""
        return self.start if self.end is None else self.end

    @property
    def amount(self) -> float:
        """LSB of noise, a probability of the line, or kelvin."""
        return self.lsb or self.probability or self.kelvin or 0.0


class MarkSection(Section, section="mark", many=True):
    """A note that is written into the recording."""

    at: float = key(_TIME, "Time of the note.")
    text: str = key(Text(), "The note itself.")


SECTIONS: dict[str, type[Section]] = {
    one.section: one
    for one in (
        ScriptSection,
        PressSection,
        BendSection,
        StretchSection,
        FaultSection,
        MarkSection,
    )
}
"""Every section by its name, in the order of the documentation."""
