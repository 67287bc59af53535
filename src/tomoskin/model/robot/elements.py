"""Attributes of a URDF's elements, read strictly."""

from __future__ import annotations

import math
from typing import Literal
from xml.etree.ElementTree import Element

from tomoskin.core import SkinError
from tomoskin.model.robot.pose import Pose


def name_of(element: Element, where: str) -> str:
    """Its name; SkinError where it has none."""
    name = element.get("name") or ""
    if not name:
        raise SkinError(f"a <{element.tag}> element has no name", where=where)
    return name


def origin_of(element: Element, where: str) -> Pose:
    """The pose that its <origin> says."""
    origin = element.find("origin")
    given = {} if origin is None else origin.attrib
    return Pose.of(
        *(numbers_of(given.get(key, "0 0 0"), 3, "<origin>", where) for key in ("xyz", "rpy"))
    )


def numbers_of(text: str, count: Literal[1, 3], what: str, where: str) -> list[float]:
    """So many finite numbers between spaces; SkinError that names ``what`` they are of."""
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        words = "a number" if count == 1 else "three numbers"
        raise SkinError(f'expected {words} in {what}, got "{text}"', where=where)
    return numbers
