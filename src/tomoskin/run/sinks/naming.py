"""What other programs know a skin by, and where it is for them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from tomoskin.core import SinkError
from tomoskin.model.robot import Place, Pose, pose_numbers

if TYPE_CHECKING:
    from tomoskin.run.sinks.sink import Stream

_NAMESPACE = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)
_FRAME = re.compile(r"[\w.-]+(/[\w.-]+)*", re.ASCII)

NAMES = ("namespace", "frame", "parent", "at")
"""Options of a sink that can say where the skin is."""


@dataclass(frozen=True, slots=True)
class Naming:
    """Before what its topics begin with, and the frame of coordinates of its positions.

    ``frame`` is the sheet's plane, x right and y up seen from the front; of a skin on a surface
    it is that of the surface. Without a name of its own it is "skin", in another namespace
    "NAMESPACE/skin". ``mount`` is the link of a robot that it lies on, where
    that is to be published.
    """

    namespace: str = "tomoskin"
    frame: str = ""
    mount: Place | None = None

    @classmethod
    def of(cls, options: Mapping[str, str], where: str) -> Self:
        """As the options of :data:`NAMES` say, as far as they are there; SinkError."""
        for key, form in (("namespace", _NAMESPACE), ("frame", _FRAME), ("parent", _FRAME)):
            text = options.get(key)
            if text is not None and not form.fullmatch(text):
                raise SinkError(
                    f'expected a {key} of letters, digits and "_", with "/" between names, '
                    f'got "{text}"',
                    where=where,
                    hint=f"for example {key}=left_arm",
                )
        if "at" in options and "parent" not in options:
            raise SinkError(
                "expected parent=… together with at=…, got at=… alone",
                where=where,
            )
        mount = None
        if "parent" in options:
            mount = _mount(options["parent"], options.get("at", ""), where)
        named = {key: options[key] for key in ("namespace", "frame") if key in options}
        return cls(**named, mount=mount)

    def of_skin(self, stream: Stream) -> Naming:
        """Of one of a robot's skins, below this; this itself where there is no robot.

        What lies on a link is told in the link's frame, and needs no transform of its own.
        """
        place = stream.place
        if place is None:
            return self
        frame = place.link or (f"{self.frame}/{place.name}" if self.frame else "")
        return Naming(f"{self.namespace}/{place.name}", frame)

    @property
    def frame_id(self) -> str:
        """Name of the frame of coordinates."""
        default = "skin" if self.namespace == Naming().namespace else f"{self.namespace}/skin"
        return self.frame or default

    def topic(self, name: str) -> str:
        """A topic in full, without its first "/": one that begins with "/" is all robots' own."""
        return name[1:] if name.startswith("/") else f"{self.namespace}/{name}"


def _mount(link: str, at: str, where: str) -> Place:
    try:
        numbers = pose_numbers(at, "m and rad")
    except ValueError as error:
        hint = "for example parent=tool0,at=0/0/0.05"
        raise SinkError(f"at: {error}", where=where, hint=hint) from None
    return Place("", link, Pose.of(numbers[:3], numbers[3:]))
