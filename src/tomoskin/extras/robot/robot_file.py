"""The robot file: its skins by name, each with its board and its place on a link; strict."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from tomoskin.core import SkinError, StrPath
from tomoskin.extras.robot.moving_link import JointPositions, PlaceOnRobot
from tomoskin.extras.robot.self_contact import OwnLinks
from tomoskin.extras.robot.urdf import Urdf
from tomoskin.files.messages import FRAME
from tomoskin.model.mesh import Pose
from tomoskin.model.section import (
    Choice,
    OneOrMore,
    Quantity,
    Row,
    Section,
    Text,
    key,
    literal,
    toml_tables,
)
from tomoskin.model.skin import read_text

FORMAT = 1
"""Version of the file that this code reads, the top-level key ``format``."""

MOST_SKINS = 64

_NAME = re.compile(r"[a-z][a-z0-9_]{0,31}")
_BOARD = re.compile(r"([0-9a-f]{2}){1,16}")
_LENGTH = Quantity("length", "mm", -100_000, 100_000)
_ANGLE = Quantity("angle", "deg", -360, 360)
_XYZ = Row({"x": _LENGTH, "y": _LENGTH, "z": _LENGTH})
_RPY = Row({"roll": _ANGLE, "pitch": _ANGLE, "yaw": _ANGLE})
_FILE = Text(1000)


class RobotSection(Section, section="robot"):
    """What the robot is called, and its model."""

    name: str = key(Text(64), "A title of one line, for people.", default="robot")
    urdf: str | None = key(
        _FILE, "The URDF with its links. The path is relative to this file.", default=None
    )
    joints: str | None = key(
        _FILE,
        "Where positions of its joints come from: `ros2` for the topic `/joint_states`, or an MCAP "
        "file of ROS 2 that holds it, perhaps with the topic: `arm.mcap:topic=/arm/states`.",
        default=None,
        needs="urdf",
    )
    self_contacts: str = key(
        Choice(("mark", "leave-out")),
        "What becomes of touches by the robot's own links.",
        default="mark",
        needs="joints",
    )
    self_margin: float = key(
        Quantity("length", "mm", 0, 1000),
        "How near the shape of a link has to be to the skin's surface to touch it: the thickness "
        "of the sheet, and what shapes and poses are wrong by.",
        default="5 mm",
        needs="joints",
    )


class SkinSection(Section, section="skin", many=True):
    """A skin, its board, and its position on a link. Paths are relative to this file."""

    name: str = key(Text(32), "Small letters, digits and `_`. Its topics begin with this name.")
    skin: str = key(_FILE, "The skin: a built-in name, or the path of a skin file.")
    source: str = key(_FILE, "The source of its frames, as for `--source`.", default="twin")
    board: str | None = key(
        Text(32),
        "Unique id of its board, as the page's set-up shows it. Another board is reported.",
        default=None,
    )
    link: str | None = key(Text(200), "Link of the URDF that the skin lies on.", default=None)
    position: tuple[float, ...] | None = key(
        _XYZ, "Position of the skin's frame in the link's frame.", default=None, needs="link"
    )
    angles: tuple[float, ...] | None = key(
        _RPY, "Angles about the link's fixed x, y and z, as in a URDF.", default=None, needs="link"
    )
    pressed_by: tuple[str, ...] = key(
        OneOrMore(Text(200)),
        "Links next to its own, held by a single joint, that can touch the skin too.",
        default=None,
        needs="link",
    )
    calibration: tuple[str, ...] = key(
        OneOrMore(_FILE), "Files from `tomoskin calibrate`, one of each kind.", default=None
    )


SECTIONS = {section.section: section for section in (RobotSection, SkinSection)}


@dataclass(frozen=True, slots=True)
class PlacedSkin:
    """One skin of a robot.

    Attributes
    ----------
    place
        Its name, and where it lies.
    skin
        Built-in name or path.
    source
        What its frames come from.
    board
        Unique id of its board, hexadecimal, or None: any.
    calibrations
        Paths, at most one of each kind.
    """

    place: PlaceOnRobot
    skin: str
    source: str = "twin"
    board: str | None = None
    calibrations: tuple[Path, ...] = ()

    @property
    def name(self) -> str:
        """Name of the skin on the robot."""
        return self.place.name


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot's skins.

    Attributes
    ----------
    urdf
        Its links; None: not known.
    joints
        What tells how they stand: "ros2…", or the path of a file; "": nothing.
    """

    source: str
    name: str
    skins: tuple[PlacedSkin, ...]
    urdf: Urdf | None = None
    joints: str = ""

    @classmethod
    def load(cls, path: StrPath) -> Self:
        """From a file.

        Raises
        ------
        SkinError
            For a value that cannot be meant, two skins of one name, board or source, or a link
            that the URDF does not have; the message says where.
        """
        path = Path(path)
        text = read_text(path, "a robot file")
        tables = toml_tables(text, str(path), FORMAT, SECTIONS)
        return cls.of(tables, str(path), path.parent)

    @classmethod
    def of(cls, tables: Mapping[str, Any], source: str, folder: StrPath) -> Self:
        """From the tables of a file: ``source`` for errors, ``folder`` of its paths; SkinError."""
        robot = RobotSection.read(tables.get("robot", {}), f"{source}: [robot]")
        urdf = None if robot.urdf is None else Urdf.read(Path(folder) / robot.urdf)
        each = enumerate(SkinSection.each(tables, source), 1)
        skins = tuple(
            _placed(_a_twin(given, n), where, Path(folder), urdf, robot)
            for n, (given, where) in each
        )
        if not 0 < len(skins) <= MOST_SKINS:
            raise SkinError(
                f"expected 1 to {MOST_SKINS} sections [[skin]], got {len(skins)}", where=source
            )
        _check_different(skins, source)
        joints = robot.joints or ""
        if joints.partition(":")[0] not in ("", "ros2"):
            joints = str(Path(folder) / joints)
        return cls(source, robot.name, skins, urdf, joints)

    def place(self, name: str, path: StrPath) -> PlaceOnRobot:
        """That of the skin called so; of a recording ``path`` without names that of the only one.

        Raises SkinError where it has none.
        """
        places = {skin.name: skin.place for skin in self.skins}
        if not name and len(places) == 1:
            return self.skins[0].place
        if name not in places:
            known, got = ", ".join(places), name or "one skin without a name"
            raise SkinError(f'expected one of {known}, got "{got}" in {path}', where=self.source)
        return places[name]

    def moved_by(self, joints: JointPositions) -> Self:
        """The same, whose skins know by ``joints`` where the links are; meshes are read here."""
        for skin in self.skins:
            _ = skin.place.own and skin.place.own.hulls
        skins = (replace(s, place=replace(s.place, joints=joints)) for s in self.skins)
        return replace(self, skins=tuple(skins))


def add_skin(path: StrPath, given: Mapping[str, Any], urdf: str | None = None) -> str:
    """Text of the robot file at ``path`` with one more skin; of a new one where there is none.

    ``given``: keys of its section as written; ``urdf``: path from the file. Raises SkinError,
    also where no robot can be made of the text.
    """
    path = Path(path)
    if path.exists():
        text = read_text(path, "a robot file").rstrip("\n")
        tables = toml_tables(text, str(path), FORMAT, SECTIONS)
        known = tables.get("robot", {}).get("urdf")
        if urdf is not None and known != urdf:
            raise SkinError(f"belongs to the URDF {known}, not to {urdf}", where=str(path))
    else:
        lines = [f"format = {FORMAT}", "", "[robot]"]
        text = "\n".join(lines + ([] if urdf is None else [f"urdf = {literal(urdf)}"]))
    entry = [f"{name} = {literal(value)}" for name, value in given.items()]
    text = "\n".join([text, "", "[[skin]]", *entry]) + "\n"
    Robot.of(toml_tables(text, str(path), FORMAT, SECTIONS), str(path), path.parent)
    return text


def _a_twin(given: SkinSection, number: int) -> SkinSection:
    """The same; a twin of which no more is said is another one than those of other numbers."""
    return replace(given, source=f"twin:seed={number}") if given.source == "twin" else given


def _placed(
    given: SkinSection, where: str, folder: Path, urdf: Urdf | None, robot: RobotSection
) -> PlacedSkin:
    for text, form, what in (
        (given.name, _NAME, "name of small letters, digits and _ that begins with a letter"),
        (given.board or "00", _BOARD, "unique id of hexadecimal digits, two a byte"),
    ):
        if not form.fullmatch(text):
            raise SkinError(f'expected a {what}, got "{text}"', where=where)
    own, zero = _own_links(given, urdf, robot, where), np.zeros(3)
    pose = Pose.of(given.position or zero, given.angles or zero)
    return PlacedSkin(
        place=PlaceOnRobot(given.name, given.link or "", pose, own),
        skin=str(folder / given.skin) if given.skin.endswith(".toml") else given.skin,
        source=_from(folder, given.source),
        board=given.board,
        calibrations=tuple(folder / path for path in given.calibration or ()),
    )


def _own_links(
    given: SkinSection, urdf: Urdf | None, robot: RobotSection, where: str
) -> OwnLinks | None:
    """What a skin on a link meets. SkinError for a link that the robot does not have, or that can
    name no frame."""
    if given.link is None:
        return None
    if urdf is None:
        raise SkinError(
            f'expected a URDF that has the link "{given.link}", got none',
            where=where,
            hint='name it in the section [robot], as in urdf = "arm.urdf", or leave out link',
        )
    named = given.pressed_by or ()
    for link in (given.link, *named):
        urdf.check_link(link, where)
    if not FRAME.fullmatch(given.link):
        raise SkinError(
            'expected a link of letters, digits, "_", "-" and ".", with "/" between names, since '
            f'it is the frame_id of all messages; got "{given.link}"',
            where=where,
            hint=f"rename it in {urdf.source}",
        )
    leaves_out = robot.self_contacts == "leave-out"
    return OwnLinks.of(urdf, given.link, named, robot.self_margin, leaves_out=leaves_out)


def _from(folder: Path, source: str) -> str:
    """A source, a replay's file from the robot file's folder."""
    name, _, argument = source.partition(":")
    return f"replay:{folder / argument}" if name == "replay" else source


def _check_different(skins: tuple[PlacedSkin, ...], source: str) -> None:
    """Two of one name, board or port would be taken for each other."""
    for what, values in (
        ("name", [skin.name for skin in skins]),
        ("board", [skin.board for skin in skins if skin.board]),
    ):
        twice = sorted({value for value in values if values.count(value) > 1})
        if twice:
            raise SkinError(f"two skins have the same {what} {twice[0]}", where=source)
    ports: dict[Path, PlacedSkin] = {}
    for skin in skins:
        kind, _, rest = skin.source.partition(":")
        port = rest.partition(",")[0]
        if kind != "serial" or not port:
            continue
        other = ports.setdefault(Path(port).resolve(), skin)  # a link to a port is that port
        if other is not skin:
            raise SkinError(
                f"expected a port of its own for each skin, got one for {other.name} "
                f"({other.source}) and {skin.name} ({skin.source})",
                where=source,
                hint=f"both are {Path(port).resolve()}" if other.source != skin.source else "",
            )
