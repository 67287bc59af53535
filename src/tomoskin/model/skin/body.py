"""The skin file: what the sheet is, what it lies on, its electrodes, and what its board does."""

from __future__ import annotations

from typing import Any

from tomoskin.model.section import (
    Choice,
    Number,
    OneOrMore,
    Quantity,
    Row,
    Section,
    Table,
    Text,
    Whole,
    key,
)

_SIZE = Quantity("length", "mm", 1, 5000)
_COORDINATE = Quantity("length", "mm", -5000, 5000)
_POINT = Row({"x": _COORDINATE, "y": _COORDINATE})
_ANGLE = Quantity("angle", "deg", -360, 360)
_ELECTRODE = Whole(0, 31)
_SIDES = ("ellipse", "rectangle")

Pairs = tuple[tuple[Any, ...], ...]
"""Rows of two."""


class NameSection(Section, section="skin"):
    """What this skin is called and what it is for."""

    name: str = key(Text(most=255), "Short name, shown on the page.")
    description: str = key(Text(), "One sentence for people.", default="")


class OutlineSection(Section, section="outline"):
    """The rim of the sheet, seen from the front. x points right, y up; discs, ellipses and
    rectangles are centred on the origin."""

    shape: str = key(Choice(("disc", *_SIDES, "polygon")), "Which outline.")
    diameter: float | None = key(_SIZE, "Diameter of the disc.", shape="disc")
    width: float | None = key(_SIZE, "Full extent along x.", shape=_SIDES)
    height: float | None = key(_SIZE, "Full extent along y.", shape=_SIDES)
    vertices: Pairs | None = key(
        Table(_POINT, 3),
        "Corners in order, either way round; the last is joined to the first.",
        shape="polygon",
    )


class SurfaceSection(Section, section="surface"):
    """What the sheet lies on. Outline, electrodes, mesh and touches stay in the sheet's own
    coordinates, as if it were laid flat; its middle lies on top, x runs around or to the
    right, y along or up. The sheet is taken as made for the surface: it is not strained."""

    shape: str = key(
        Choice(("flat", "cylinder", "cap", "saddle", "arm", "file")),
        "flat; wrapped around a cylinder; on a sphere; on a saddle, such as a chair's back; "
        "wrapped around a limb with a joint; or on the surface of a file. `tomoskin skin "
        "lay` writes the skin of a file.",
        default="flat",
    )
    radius: float | None = key(
        _SIZE, "Radius of the cylinder, sphere or limb.", shape=("cylinder", "cap", "arm")
    )
    axis: float = key(
        _ANGLE,
        "Direction of the cylinder's axis in the sheet, counter-clockwise from +x.",
        default="90 deg",
        shape="cylinder",
    )
    radius_x: float | None = key(
        _SIZE, "Radius of curvature of a saddle along x, where it bends away.", shape="saddle"
    )
    radius_y: float | None = key(
        _SIZE, "Radius of curvature of a saddle along y, where it bends forward.", shape="saddle"
    )
    bend: float = key(
        Quantity("angle", "deg", -170, 170),
        "Angle of the limb's joint; positive stretches the sheet at x = 0.",
        default="0 deg",
        shape="arm",
    )
    joint: float | None = key(
        _SIZE, "Length over which the limb's middle line bends, about y = 0.", shape="arm"
    )
    file: str | None = key(
        Text(),
        "A .stl, .obj, .ply or .dae file, beside the skin file unless the path is absolute.",
        shape="file",
    )
    unit: str = key(
        Choice(("mm", "cm", "m")), "Unit of the file's coordinates.", default="mm", shape="file"
    )
    layer: float | None = key(
        Quantity("length", "mm", 0.05, 1000),
        "Thickness of the soft layer under the sheet: no press can exceed it, and touches are "
        "fitted as wide as it carries the sheet along.",
        default=None,
    )


class ElectrodesSection(Section, section="electrodes"):
    """Electrodes on the rim: either evenly spaced (count, first, order) or one by one
    (positions)."""

    count: int | None = key(
        Whole(4, 32), "Number of electrodes, evenly spaced along the rim.", unless="positions"
    )
    first: float = key(
        _ANGLE,
        "Direction of the middle of E1 seen from the sheet's centroid, counter-clockwise from +x.",
        default="90 deg",
        unless="positions",
    )
    order: str = key(
        Choice(("clockwise", "counter-clockwise")),
        "Way in which E1, E2, … follow each other, seen from the front.",
        default="clockwise",
        unless="positions",
    )
    positions: Pairs | None = key(
        Table(_POINT, 4),
        "Middle of each electrode, E1 first; each must lie on the rim.",
        default=None,
    )
    width: float = key(Quantity("length", "mm", 0.1, 1000), "Width of an electrode along the rim.")
    contact_impedance: tuple[float, ...] = key(
        OneOrMore(Quantity("resistivity", "ohm*m", 1e-9, 1e6), ", one per electrode"),
        "Contact resistance times electrode width; one value or one per electrode.",
    )


class MaterialSection(Section, section="material"):
    """What the sheet of the skin is made of."""

    sheet_resistance: float = key(
        Quantity("sheet resistance", "ohm/sq", 1e-4, 1e8),
        "Resistance of a square of the unloaded sheet.",
    )
    gauge: float | None = key(
        Number(-1000, 1000),
        "Relative rise of resistance per mean strain in the plane, as strips are measured: "
        "deformations then are strains.",
        default=None,
    )
    gauge_across: float | None = key(
        Number(-1000, 1000),
        "The same for half the difference of the two principal strains: positive where a strip "
        "conducts less along its stretch than across it.",
        default=None,
        needs="gauge",
    )


class DriveSection(Section, section="drive"):
    """Where current flows and what is read: a named pattern, or two tables of your own."""

    pattern: str = key(
        Text(),
        "adjacent, opposite, all_pairs, skip:K, or several joined by +.",
        default="adjacent",
        unless="drive",
    )
    drive: Pairs | None = key(
        Table(Row({"source": _ELECTRODE, "sink": _ELECTRODE})),
        "Driven electrodes of each measurement, counted from 0: E1 is 0.",
        default=None,
        needs="measure",
    )
    measure: Pairs | None = key(
        Table(Row({"plus": _ELECTRODE, "minus": _ELECTRODE})),
        "Read electrodes of each measurement, counted from 0: E1 is 0.",
        default=None,
        needs="drive",
    )
    current: float = key(Quantity("current", "mA", 0.001, 1000), "Driven current.")
    mode: str | None = key(
        Choice(("direct", "chopped")),
        "direct: from source to sink. chopped: each pair is driven one way and then the other, "
        "for skins and contacts that polarise; the board reads what turns with the current.",
        default=None,
    )
    chop_frequency: float = key(
        Quantity("frequency", "kHz", 0.01, 5),
        "Of the alternation; settling and the board bound it.",
        default="0.2 kHz",
        mode="chopped",
    )
    polarity: str | None = key(
        Choice(("normal", "reversed")),
        "reversed: voltages come with the opposite sign, as from swapped amplifier inputs; "
        "`tomoskin calibrate mapping` finds it.",
        default=None,
    )


class ReadoutSettings(Section, section="readout"):
    """The amplifier and converter: counts = (gain · potential + offset) / reference · 2^bits."""

    adc_bits: int = key(Whole(8, 16), "Resolution of the converter.", default=10)
    reference_voltage: float = key(
        Quantity("voltage", "V", 0.5, 10), "Full scale of the converter.", default="5 V"
    )
    gain: float = key(Number(0.01, 10_000), "Gain in front of the converter.", default=40)
    offset: float = key(
        Quantity("voltage", "V", -10, 10),
        "Voltage at the converter for a potential of 0 V.",
        default="0 V",
    )
    oversampling: int = key(
        Whole(1, 64),
        "Readings summed for one sample; the sum must fit in 16 bits.",
        default=16,
    )
    settling: float = key(
        Quantity("time", "ms", 0, 1000), "Wait after each switch of the drive.", default="2 ms"
    )
    tick_rate: float = key(
        Quantity("frequency", "kHz", 0.1, 100_000),
        "Rate of the device's clock.",
        default="250 kHz",
    )
