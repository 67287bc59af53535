"""The skin file: what the sheet is, what it lies on and where its electrodes are."""

from __future__ import annotations

from tomoskin.skin.kinds import Choice, Name, OneOrEach, Quantity, Rows, Text, Whole
from tomoskin.skin.schema.entry import Key, Section

_SIZE = Quantity("length", "mm", 1, 5000)
_PLACE = Quantity("length", "mm", -5000, 5000)
_SIDES = ("ellipse", "rectangle")

SHEET: tuple[Section, ...] = (
    Section(
        "skin",
        "What this skin is.",
        (
            Key("name", Name(), "Short name, shown on the page.", required=True),
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
)
"""The sheet, its outline and its electrodes."""
