"""The script of the twin, declared once: reading, errors and documentation follow."""

from __future__ import annotations

from tomoskin.skin import Choice, Key, Number, Quantity, Section, Text, Whole
from tomoskin.twin.script_kinds import Course, Listed, Row, Span, Words
from tomoskin.twin.settings import PRESETS

FORMAT = 1
"""Version of the file that this code reads, the top-level key ``format``."""

SHAPES = ("circle", "square", "finger", "polygon")
"""Faces of probes that a script can press with."""

DRAWN_SHAPES = ("circle", "square", "finger")
"""Faces that labelled frames are drawn from: those of one size."""

_PRESET = Choice(tuple(PRESETS))
_TIME = Quantity("time", "s", 0, 86400)
_LASTS = Quantity("time", "s", 0, 3600)
_FORCE = Quantity("force", "N", 0, 1000)
_SIZE = Quantity("length", "mm", 0.5, 1000)
_LENGTH = Quantity("length", "mm", -5000, 5000)
_POINT = Row(("x", "y"), (_LENGTH, _LENGTH))
_ANGLE = Quantity("angle", "deg", -360, 360)

SCRIPT = Section(
    "script",
    "The whole. Time 0 is the end of the lead-in; all other times count from there.",
    (
        Key("name", Text(), "One line for people.", default=""),
        Key(
            "duration", Quantity("time", "s", 0.01, 86400), "From time 0 to the end.", required=True
        ),
        Key(
            "lead_in",
            Quantity("time", "s", 0, 3600),
            "Idle time before time 0, for the reference.",
            default="1 s",
        ),
        Key("seed", Whole(0, 2**31 - 1), "Of all noise; --seed wins over it.", default=0),
        Key("preset", _PRESET, "The twin's material and board, instead of the skin's own."),
    ),
)

PRESS = Section(
    "press",
    "A probe pressed on the sheet. It stands from `start` on for as long as its force lasts.",
    (
        Key("id", Text(), "Name; two presses at once must differ in it.", required=True),
        Key("shape", Choice(SHAPES), "Face of the probe.", default="circle"),
        Key("radius", _SIZE, "Of the circle.", required=True, when=("shape", ("circle",))),
        Key("side", _SIZE, "Of the square.", required=True, when=("shape", ("square",))),
        Key("length", _SIZE, "Of the fingertip.", default="22 mm", when=("shape", ("finger",))),
        Key("width", _SIZE, "Of the fingertip.", default="16 mm", when=("shape", ("finger",))),
        Key(
            "vertices",
            Listed(_POINT, 3),
            "Corners around the middle of the probe.",
            required=True,
            when=("shape", ("polygon",)),
        ),
        Key(
            "crown",
            Quantity("length", "mm", 1, 100_000),
            "Radius of curvature of a face that is not flat; that of a ball is its radius.",
            when=("shape", ("circle", "square", "polygon")),
        ),
        Key("angle", _ANGLE, "By which the face is turned, counter-clockwise.", default="0 deg"),
        Key("at", _POINT, "Where its middle stands first.", required=True),
        Key(
            "path",
            Course(Row(("time", "x", "y"), (_TIME, _LENGTH, _LENGTH))),
            "Sliding: places of the middle at times since `start`, from `at` on in straight lines.",
        ),
        Key(
            "motion",
            Choice(("slide", "roll")),
            "How it follows its path: by its friction it drags the sheet along.",
            default="slide",
        ),
        Key("start", _TIME, "When it touches the sheet.", required=True),
        Key("force", _FORCE, "Force while it is held.", required=True, unless="profile"),
        Key("rise", _LASTS, "From 0 to the force, evenly.", default="200 ms", unless="profile"),
        Key("hold", _LASTS, "At the force.", required=True, unless="profile"),
        Key("fall", _LASTS, "From the force to 0, evenly.", default="200 ms", unless="profile"),
        Key(
            "profile",
            Course(Row(("time", "force"), (_TIME, _FORCE))),
            "Instead of these: force at times since `start`, from 0 N to 0 N in straight lines.",
        ),
    ),
    many=True,
)

FAULT_KINDS = (
    *("cut", "short", "rail", "noise", "loss", "corruption", "delay"),
    *("reboot", "temperature"),
)
"""What can go wrong; all but the last two last from `start` to `end`."""

_OF_ELECTRODE = ("cut", "short", "rail")
_OF_LINE = ("loss", "corruption", "delay")

FAULT = Section(
    "fault",
    "Something that goes wrong: a wire is `cut`, two electrodes touch (`short`), a channel stands "
    "at its `rail`, the converter is noisy (`noise`), bytes are lost (`loss`), altered "
    "(`corruption`) or late (`delay`), the board loses its power (`reboot`), it gets warmer "
    "(`temperature`).",
    (
        Key("kind", Choice(FAULT_KINDS), "Which.", required=True),
        Key("start", _TIME, "When it begins.", required=True),
        Key(
            "end",
            _TIME,
            "When it is mended.",
            required=True,
            when=("kind", FAULT_KINDS[:-2]),
        ),
        Key(
            "electrode",
            Whole(0, 31),
            "Whose, counted from 0.",
            required=True,
            when=("kind", _OF_ELECTRODE),
        ),
        Key(
            "other",
            Whole(0, 31),
            "The one that it touches.",
            required=True,
            when=("kind", ("short",)),
        ),
        Key(
            "lsb",
            Number(0, 1000),
            "Standard deviation of one conversion.",
            required=True,
            when=("kind", ("noise",)),
        ),
        Key(
            "probability",
            Number(0, 0.999),
            "Of each byte; for a delay, of each read.",
            required=True,
            when=("kind", _OF_LINE),
        ),
        Key(
            "kelvin",
            Number(-100, 100),
            "Step of the sheet's temperature.",
            required=True,
            when=("kind", ("temperature",)),
        ),
    ),
    many=True,
)

MARK = Section(
    "mark",
    "A note in the recording.",
    (
        Key("at", _TIME, "When.", required=True),
        Key("text", Text(), "What.", required=True),
    ),
    many=True,
)

PRESSES = Section(
    "presses",
    "Instead of a timeline: what labelled frames are drawn from, each frame on its own "
    "(`--presses N`). Ranges are drawn from evenly.",
    (
        Key("preset", _PRESET, "The twin's material and board, instead of the skin's own."),
        Key("count", Span(Whole(0, 8)), "Presses at once.", default=1),
        Key("shapes", Words(DRAWN_SHAPES), "Faces, one as likely as another.", default="circle"),
        Key(
            "size",
            Span(_SIZE),
            "Radius of a circle, half the side of a square or the length of a fingertip; "
            "rounded to 0.5 mm.",
            required=True,
        ),
        Key("force", Span(_FORCE), "Force of each press.", required=True),
        Key(
            "hold",
            Quantity("time", "s", 0.01, 3600),
            "How long it has been pressed: the sheet creeps.",
            default="1 s",
        ),
        Key(
            "margin",
            Quantity("length", "mm", 0, 1000),
            "The middle of a probe stays that far from the rim.",
            default="5 mm",
        ),
        Key(
            "apart",
            Quantity("length", "mm", 0, 1000),
            "The middles of two probes stay that far apart.",
            default="40 mm",
        ),
    ),
)

BENDS = ("hinge", "joint")
"""Ways in which a sheet is bent."""

_COURSE = (
    Key("start", _TIME, "When it begins.", required=True),
    Key("rise", _LASTS, "Until all of it is reached, evenly.", default="1 s", unless="profile"),
    Key("hold", _LASTS, "For which it stays.", required=True, unless="profile"),
    Key("fall", _LASTS, "Until none is left, evenly.", default="1 s", unless="profile"),
)

BEND = Section(
    "bend",
    "The sheet is bent, and is straight again at the end. Several at once add up.",
    (
        Key(
            "kind",
            Choice(BENDS),
            "hinge: along a strip, flat on both sides. joint: around a limb with a joint, as "
            "[surface] of a skin does.",
            default="hinge",
        ),
        Key(
            "length",
            Quantity("length", "mm", 1, 10_000),
            "Width of the strip, or length of the limb's middle line over which it bends.",
            required=True,
        ),
        Key(
            "axis",
            _ANGLE,
            "Direction of the strip, from x counter-clockwise.",
            default="90 deg",
            when=("kind", ("hinge",)),
        ),
        Key(
            "offset",
            _LENGTH,
            "Of the strip's middle line from the middle of the sheet, to the right as seen along "
            "the axis.",
            default="0 mm",
            when=("kind", ("hinge",)),
        ),
        Key(
            "radius",
            Quantity("length", "mm", 1, 10_000),
            "Of the limb.",
            required=True,
            when=("kind", ("joint",)),
        ),
        Key(
            "angle",
            _ANGLE,
            "How far; positive where the front becomes convex.",
            required=True,
            unless="profile",
        ),
        *_COURSE,
        Key(
            "profile",
            Course(Row(("time", "angle"), (_TIME, _ANGLE))),
            "Instead of these: angle at times since `start`, from 0 to 0 deg in straight lines.",
        ),
    ),
    many=True,
)

_STRAIN = Number(-0.5, 1.0)

STRETCH = Section(
    "stretch",
    "The sheet is stretched evenly, and is as long as it was at the end.",
    (
        Key(
            "strain", _STRAIN, "Relative elongation: 0.05 is 5 %.", required=True, unless="profile"
        ),
        Key("across", Number(-1, 1), "Elongation across the axis, per that along it.", default=0),
        Key("axis", _ANGLE, "Direction, from x counter-clockwise.", default="0 deg"),
        *_COURSE,
        Key(
            "profile",
            Course(Row(("time", "strain"), (_TIME, _STRAIN))),
            "Instead of these: elongation at times since `start`, from 0 to 0 in straight lines.",
        ),
    ),
    many=True,
)

SECTIONS = (SCRIPT, PRESS, BEND, STRETCH, FAULT, MARK, PRESSES)
"""Every section and key, in the order of the documentation."""
