"""The skin file, declared once: reading, errors, writing and its documentation follow."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.skin.kinds import (
    Choice,
    Kind,
    Number,
    NumberOrWord,
    OneOrEach,
    Quantity,
    Rows,
    Text,
    Whole,
)

FORMAT = 1
"""Version of the file that this code reads, the top-level key ``format``."""

Raw = str | int | float
"""A default as it would stand in the file."""


@dataclass(frozen=True)
class Key:
    """One key of a section.

    Attributes
    ----------
    kind
        What its value may be.
    meaning
        A sentence for the documentation.
    default
        Value when the key is absent; None where there is none.
    required
        The key must be there (where ``when`` and ``unless`` let it stand at all).
    when
        Another key of the section and the values of it for which this one may stand.
    unless
        Another key of the section that takes this one's place.
    needs
        Another key of the section that must stand beside this one.
    """

    name: str
    kind: Kind
    meaning: str
    default: Raw | None = None
    required: bool = False
    when: tuple[str, tuple[str, ...]] | None = None
    unless: str = ""
    needs: str = ""


@dataclass(frozen=True)
class Section:
    """A table of the file; with ``many``, a list of tables."""

    name: str
    meaning: str
    keys: tuple[Key, ...]
    many: bool = False

    @property
    def heading(self) -> str:
        """The line that begins it."""
        return f"[[{self.name}]]" if self.many else f"[{self.name}]"


_SIZE = Quantity("length", "mm", 1, 5000)
_PLACE = Quantity("length", "mm", -5000, 5000)
_ELECTRODE = Whole(0, 31)
_SIDES = ("ellipse", "rectangle")
_ONE_STEP = ("method", ("one-step",))

SECTIONS: tuple[Section, ...] = (
    Section(
        "skin",
        "What this skin is.",
        (
            Key("name", Text(), "Short name, shown on the page.", required=True),
            Key("description", Text(), "One sentence for people.", default=""),
        ),
    ),
    Section(
        "outline",
        "The rim of the sheet, seen from the front. x points right, y up; discs, ellipses and "
        "rectangles are centred on the origin.",
        (
            Key(
                "shape",
                Choice(("disc", "ellipse", "rectangle", "polygon")),
                "Which outline.",
                required=True,
            ),
            Key(
                "diameter",
                _SIZE,
                "Diameter of the disc.",
                required=True,
                when=("shape", ("disc",)),
            ),
            Key(
                "width",
                _SIZE,
                "Full extent along x.",
                required=True,
                when=("shape", _SIDES),
            ),
            Key(
                "height",
                _SIZE,
                "Full extent along y.",
                required=True,
                when=("shape", _SIDES),
            ),
            Key(
                "vertices",
                Rows(_PLACE, ("x", "y"), 3),
                "Corners in order, either way round; the last is joined to the first.",
                required=True,
                when=("shape", ("polygon",)),
            ),
        ),
    ),
    Section(
        "surface",
        "What the sheet lies on. Outline, electrodes, mesh and touches stay in the sheet's own "
        "coordinates, as if it were laid flat; its middle lies on top, x runs around or to the "
        "right, y along or up. The sheet is taken as made for the surface: it is not strained.",
        (
            Key(
                "shape",
                Choice(("flat", "cylinder", "cap", "saddle", "arm", "file")),
                "flat; wrapped on a cylinder; drawn over a sphere; hung over a saddle, as a "
                "chair's back; wrapped around a limb with a joint; on the surface of a file, for "
                "which `tomoskin skin lay` writes the skin.",
                default="flat",
            ),
            Key(
                "radius",
                _SIZE,
                "Of cylinder, sphere or limb.",
                required=True,
                when=("shape", ("cylinder", "cap", "arm")),
            ),
            Key(
                "axis",
                Quantity("angle", "deg", -360, 360),
                "Direction of the cylinder's axis in the sheet, counter-clockwise from +x.",
                default="90 deg",
                when=("shape", ("cylinder",)),
            ),
            Key(
                "radius_x",
                _SIZE,
                "How a saddle bends away to the sides.",
                required=True,
                when=("shape", ("saddle",)),
            ),
            Key(
                "radius_y",
                _SIZE,
                "How a saddle bends forward along y.",
                required=True,
                when=("shape", ("saddle",)),
            ),
            Key(
                "bend",
                Quantity("angle", "deg", -170, 170),
                "Angle of the limb's joint; positive stretches the sheet at x = 0.",
                default="0 deg",
                when=("shape", ("arm",)),
            ),
            Key(
                "joint",
                _SIZE,
                "Length over which the limb's middle line bends, about y = 0.",
                required=True,
                when=("shape", ("arm",)),
            ),
            Key(
                "file",
                Text(),
                "A .stl, .obj or .ply file, beside the skin file unless the path is absolute.",
                required=True,
                when=("shape", ("file",)),
            ),
            Key(
                "unit",
                Choice(("mm", "cm", "m")),
                "Of the file's coordinates.",
                default="mm",
                when=("shape", ("file",)),
            ),
        ),
    ),
    Section(
        "electrodes",
        "Electrodes on the rim: either evenly spaced (count, first, order) or one by one "
        "(positions).",
        (
            Key(
                "count",
                Whole(4, 32),
                "Number of electrodes, evenly spaced along the rim.",
                required=True,
                unless="positions",
            ),
            Key(
                "first",
                Quantity("angle", "deg", -360, 360),
                "Direction of the middle of E1 seen from the sheet's centroid, counter-clockwise "
                "from +x.",
                default="90 deg",
                unless="positions",
            ),
            Key(
                "order",
                Choice(("clockwise", "counter-clockwise")),
                "Way in which E1, E2, … follow each other, seen from the front.",
                default="clockwise",
                unless="positions",
            ),
            Key(
                "positions",
                Rows(_PLACE, ("x", "y"), 4),
                "Middle of each electrode, E1 first; each must lie on the rim.",
            ),
            Key(
                "width",
                Quantity("length", "mm", 0.1, 1000),
                "Width of an electrode along the rim.",
                required=True,
            ),
            Key(
                "contact_impedance",
                OneOrEach(Quantity("resistivity", "ohm*m", 1e-9, 1e6)),
                "Contact resistance times electrode width; one value or one per electrode.",
                required=True,
            ),
        ),
    ),
    Section(
        "material",
        "The sheet.",
        (
            Key(
                "sheet_resistance",
                Quantity("sheet resistance", "ohm/sq", 1e-4, 1e8),
                "Resistance of a square of the unloaded sheet.",
                required=True,
            ),
        ),
    ),
    Section(
        "drive",
        "Where current flows and what is read: a named pattern, or two tables of your own.",
        (
            Key(
                "pattern",
                Text(),
                "adjacent, opposite, all_pairs, skip:K, or several joined by +.",
                default="adjacent",
                unless="drive",
            ),
            Key(
                "drive",
                Rows(_ELECTRODE, ("source", "sink"), 1),
                "Driven electrodes of each measurement, counted from 0.",
                needs="measure",
            ),
            Key(
                "measure",
                Rows(_ELECTRODE, ("plus", "minus"), 1),
                "Read electrodes of each measurement, counted from 0.",
                needs="drive",
            ),
            Key(
                "current",
                Quantity("current", "mA", 0.001, 1000),
                "Driven current.",
                required=True,
            ),
            Key(
                "polarity",
                Choice(("normal", "reversed")),
                "reversed: voltages come with the opposite sign, as from swapped amplifier inputs; "
                "`tomoskin calibrate wiring` finds it.",
            ),
        ),
    ),
    Section(
        "readout",
        "The amplifier and converter: counts = (gain · potential + offset) / reference · 2^bits.",
        (
            Key("adc_bits", Whole(8, 16), "Resolution of the converter.", default=10),
            Key(
                "reference_voltage",
                Quantity("voltage", "V", 0.5, 10),
                "Full scale of the converter.",
                default="5 V",
            ),
            Key("gain", Number(0.01, 10_000), "Gain in front of the converter.", default=40),
            Key(
                "offset",
                Quantity("voltage", "V", -10, 10),
                "Voltage at the converter for a potential of 0 V.",
                default="0 V",
            ),
            Key(
                "oversampling",
                Whole(1, 64),
                "Readings summed for one sample; the sum must fit in 16 bits.",
                default=16,
            ),
            Key(
                "settling",
                Quantity("time", "ms", 0, 1000),
                "Wait after each switch of the drive.",
                default="2 ms",
            ),
            Key(
                "tick_rate",
                Quantity("frequency", "kHz", 0.1, 100_000),
                "Rate of the device's clock.",
                default="250 kHz",
            ),
        ),
    ),
    Section(
        "mesh",
        "The triangles that the picture is made of.",
        (Key("cells", Whole(50, 100_000), "Wanted number, met within 10 %.", default=1500),),
    ),
    Section(
        "inverse",
        "How voltages become a picture.",
        (
            Key(
                "method",
                Choice(("one-step", "greit")),
                "one-step: the most likely picture under a prior. greit: an operator trained to "
                "show small targets as a stated response; truer places, not sharper.",
                default="one-step",
            ),
            Key(
                "prior",
                Choice(("identity", "laplace", "gaussian", "noser", "exponential", "matern")),
                "What is held to be likely.",
                default="noser",
                when=_ONE_STEP,
            ),
            Key(
                "exponent",
                Number(0, 2),
                "With noser: the power of a cell's sensitivity that weighs it down.",
                default=0.5,
                when=_ONE_STEP,
            ),
            Key(
                "correlation_length",
                Quantity("length", "mm", 0.1, 5000),
                "With exponential and matern: how far a change is alike; without it a tenth of "
                "the sheet's extent.",
                when=_ONE_STEP,
            ),
            Key(
                "alpha",
                NumberOrWord(Number(1e-9, 1e9), Choice(("auto",))),
                "Weight of the prior; it enters squared. auto: chosen by the noise, for a light "
                "touch.",
                default="auto",
                when=_ONE_STEP,
            ),
            Key(
                "noise_figure",
                Number(0.1, 100),
                "How much noisier the picture may be than the voltages, signal for signal.",
                default=1.0,
                when=("method", ("greit",)),
            ),
            Key(
                "difference",
                Choice(("plain", "normalised")),
                "v − v_ref, or (v − v_ref)/|v_ref|.",
                default="plain",
            ),
            Key(
                "time_constant",
                Quantity("time", "s", 0, 3600),
                "How long a picture lasts: each rests on the frames before it too, the more the "
                "longer this is (Kalman filter). 0 s: on its own frame alone.",
                default="0 s",
                when=_ONE_STEP,
            ),
        ),
    ),
    Section(
        "signal",
        "What becomes of the reference while time goes by.",
        (
            Key(
                "baseline",
                Choice(("follow", "hold")),
                "follow: the reference follows the skin's drift while nothing touches, and holds "
                "under a touch. hold: it stays as it was taken.",
                default="follow",
            ),
            Key(
                "common_modes",
                Choice(("projected", "kept")),
                "projected: a change of all voltages in proportion, as temperature makes it, and "
                "directions of drift learnt while idle do not show in the picture. kept: they do.",
                default="projected",
            ),
        ),
    ),
    Section(
        "touch",
        "How data become touches.",
        (
            Key(
                "method",
                Choice(("image", "fit")),
                "image: regions of the picture, by gamma1 to position. fit: place, size and "
                "strength of up to five touches, fitted to the voltages; truer, with honest "
                "deviations.",
                default="image",
            ),
            Key(
                "gamma1",
                Number(0.1, 0.99),
                "First threshold, as a part of the extreme value; 0.6 to 0.7 is usual.",
                default=0.65,
            ),
            Key(
                "gamma2",
                Number(0.1, 1),
                "Second threshold, after smoothing, as a part of the first.",
                default=0.9,
            ),
            Key(
                "smoothing",
                Quantity("length", "mm", 0, 1000),
                "Standard deviation of the Gaussian between the two thresholds.",
                default="5 mm",
            ),
            Key(
                "sign",
                Choice(("decrease", "increase", "both")),
                "Change of conductivity that counts as a touch.",
                default="decrease",
            ),
            Key(
                "snr",
                Number(0, 1000),
                "Extreme value that a touch needs, in standard deviations of the noise.",
                default=5,
            ),
            Key(
                "position",
                Choice(("centroid", "peak")),
                "One touch a region, at its weighted centroid; or one at each local extreme.",
                default="centroid",
            ),
            Key("max_touches", Whole(1, 50), "Most touches reported at once.", default=8),
        ),
    ),
    Section(
        "twin",
        "The simulated skin that stands in for this one; a real skin does not read it.",
        (
            Key(
                "preset",
                Choice(("ideal", "textile", "hydrogel", "tank")),
                "Material and board: without vices and memory, or as measured or assumed.",
                default="ideal",
            ),
        ),
    ),
)
"""Every section and key, in the order in which they are written."""
