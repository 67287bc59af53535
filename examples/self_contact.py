"""An arm that touches itself: how many of its own touches are marked, and how many of others'.

A forearm reaches over to a skin on the upper arm and presses it, slides, and hovers above it, while
a finger presses elsewhere. The arm that presses is not quite the one of the URDF: its bumper is
off by 1 to 2 mm and its radius by up to 1 mm, by the seed, as is the size of each touch.

    python examples/self_contact.py --rigs 4 --seconds 120
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tomoskin.core import FloatArray, Touch
from tomoskin.extras.robot import Robot
from tomoskin.files.messages import Contacts, Stream
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

SKIN = "textile-disc-16"
ARM = """<robot name="arm"><link name="base"/>
<link name="upper"><collision><geometry><box size="0.3 0.24 0.06"/></geometry></collision></link>
<link name="yoke"/><link name="sleeve"/>
<link name="fore"><collision><geometry><sphere radius="0.02"/></geometry></collision>
  <collision><origin xyz="-0.06 0 0" rpy="0 1.5707963267948966 0"/>
    <geometry><capsule radius="0.012" length="0.12"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/></joint>
<joint name="sway" type="revolute"><parent link="upper"/><child link="yoke"/>
  <origin xyz="0.22 0 0.15"/><axis xyz="0 0 1"/></joint>
<joint name="elbow" type="revolute"><parent link="yoke"/><child link="sleeve"/>
  <axis xyz="0 1 0"/></joint>
<joint name="reach" type="prismatic"><parent link="sleeve"/><child link="fore"/></joint></robot>"""
ROBOT = """format = 1
[robot]
urdf = "arm.urdf"
joints = "states.mcap"
[[skin]]
name = "pad"
skin = "{skin}"
link = "upper"
position = ["0 mm", "0 mm", "30 mm"]
"""

ELBOW = np.array([0.22, 0.0, 0.12])
"""Of the elbow above the middle of the skin, m."""

BUMPER, ROD = 0.02, 0.012
"""Radii of the forearm's end and of the rest of it, m."""

STIFFNESS = 2000.0
"""Of the pad under the sheet, N/m."""

FARTHEST = 0.075
"""Of presses from the middle of the sheet, m."""

FADING = 0.3
"""Seconds for which a touch may be that of a press that has ended."""

REACH = 0.03
"""m from a press to the touch that it makes."""

BEGUN = 1_700_000_000.0
"""s since 1970 of the first frame: joint states are by the time of the day."""

OWN, OTHER = "own", "other"


def on_sheet(rng: np.random.Generator) -> FloatArray:
    """A point of the sheet, evenly."""
    angle = rng.uniform(0, 2 * np.pi)
    return FARTHEST * np.sqrt(rng.uniform()) * np.array([np.cos(angle), np.sin(angle)])


@dataclass
class Arm:
    """Where the end of the forearm goes: times, s, and points above the skin, m."""

    rng: np.random.Generator
    seconds: float
    times: list[float] = field(default_factory=lambda: [0.0, 2.0])
    points: list[FloatArray] = field(default_factory=list)
    wrong: FloatArray = field(init=False)
    radius: float = field(init=False)

    def __post_init__(self) -> None:
        """Draw what is wrong with the URDF, and the way."""
        rng = self.rng
        direction = rng.normal(size=3)
        self.wrong = rng.uniform(1e-3, 2e-3) * direction / np.linalg.norm(direction)
        self.radius = BUMPER + rng.uniform(-1e-3, 1e-3)
        self.points = [np.array([0, 0, 0.1])] * 2
        while self.times[-1] < self.seconds:
            place, end = on_sheet(rng), on_sheet(rng)
            end = place + (end - place) * min(1.0, rng.uniform(0, 0.03) / np.hypot(*(end - place)))
            above = self.radius + rng.uniform(0.003, 0.04)
            down = self.radius - rng.uniform(0.5e-3, 3e-3)
            if rng.uniform() < 0.3:
                down = above  # it hovers, and does not touch
            self._go(rng.uniform(0.5, 2), place, above)
            self._go(rng.uniform(0.2, 0.5), place, down)
            self._go(rng.uniform(0.5, 2), end, down)
            self._go(rng.uniform(0.2, 0.5), end, above)

    def _go(self, seconds: float, place: FloatArray, height: float) -> None:
        self.times.append(self.times[-1] + seconds)
        self.points.append(np.array([*place, height]))

    def end(self, time: float) -> FloatArray:
        """(3,) m where the end truly is, above the skin."""
        points = np.array(self.points).T
        return np.array([np.interp(time, self.times, axis) for axis in points])

    def joints(self, time: float) -> dict[str, float]:
        """Positions of the joints, as encoders have them: they do not know what is wrong."""
        x, y, z = self.end(time) - self.wrong - ELBOW
        level = np.hypot(x, y)
        turns = {"sway": np.arctan2(y, x), "elbow": np.arctan2(-z, level)}
        return {"shoulder": 0.3, "reach": float(np.hypot(level, z))} | turns

    def press(self, time: float, size: float) -> Sequence[Press]:
        """What it presses with, as a flat tip of a random ``size``, m."""
        x, y, z = self.end(time)
        force = STIFFNESS * (self.radius - z)
        return (Press(x, y, force, size),) if force > 0 else ()

    def is_free(self, time: float, finger: Press) -> bool:
        """Whether a finger that comes from above has room beside the forearm."""
        end = self.end(time)
        rod = end + np.linspace(0, 0.12, 25)[:, None] * (ELBOW - end) / np.linalg.norm(ELBOW - end)
        away = np.hypot(*(rod[:, :2] - (finger.x, finger.y)).T)
        radii = np.where(np.arange(25) == 0, self.radius, ROD)
        return bool((away > finger.radius + radii)[rod[:, 2] - radii < 0.08].all())


@dataclass
class Finger:
    """Presses somewhere, now and then."""

    rng: np.random.Generator
    start: float = 3.0
    held: float = 0.0
    press: Press = field(default_factory=lambda: Press(0, 0, 0, 0.01))

    def at(self, time: float, arm: Arm) -> Sequence[Press]:
        """What it presses with; it draws back where the arm comes."""
        if time > self.start + self.held:
            rng = self.rng
            self.start, self.held = time + rng.uniform(0.5, 2), rng.uniform(0.5, 2.5)
            x, y = on_sheet(rng)
            self.press = Press(x, y, rng.uniform(1.5, 6), rng.uniform(6e-3, 12e-3))
        if time < self.start:
            return ()
        if not arm.is_free(time, self.press):
            self.held = 0.0
            return ()
        return (self.press,)


Counts = Counter[tuple[str, bool | None]]
"""Touches by whose they are, and by what they are marked as."""


def counted(prepared: Prepared, robot: Robot, seed: int, seconds: float) -> Counts:
    """Touches of all frames of a rig."""
    rng = np.random.default_rng(seed)
    twin = SteppedSkin(prepared, TwinSettings.preset(prepared.skin.twin.preset, seed))
    arm, finger, size = Arm(rng, seconds), Finger(rng), 0.008
    place = robot.moved_by(lambda utc: arm.joints(utc - BEGUN).__getitem__).skins[0].place
    stream = Stream.of(prepared, "twin", BEGUN, place)
    recent: list[tuple[float, str, Press]] = []
    counts: Counts = Counter()
    assert twin.result is not None
    while (time := twin.result.scanned + twin.period) < seconds:  # the middle of the next scan
        own, other = arm.press(time, size), finger.at(time, arm)
        if not own:
            size = rng.uniform(5e-3, 12e-3)
        twin.step([*own, *other])
        recent = [moment for moment in recent if time - moment[0] < FADING]
        recent += [(time, OWN, press) for press in own] + [(time, OTHER, press) for press in other]
        for contact in Contacts.of(stream, twin.result).touches:
            counts[whose(contact.touch, recent), contact.is_self] += 1
    return counts


def whose(touch: Touch, recent: Sequence[tuple[float, str, Press]]) -> str:
    """Which of those that press, or did a moment before, made a touch; "" where none did."""
    place = np.array([touch.detection.x, touch.detection.y])
    far = [(float(np.hypot(*(place - (p.x, p.y)))), who) for _, who, p in recent]
    nearest, who = min(far, default=(REACH, ""))
    return who if nearest < REACH else ""


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Count on some rigs, and print the shares."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--rigs", type=int, default=4, help="arms, each with a sheet of its own")
    parser.add_argument("--seconds", type=float, default=120, help="of each")
    parser.add_argument("--seed", type=int, default=1, help="of the first")
    parser.add_argument("--skin", default=SKIN, help="on the upper arm")
    options = parser.parse_args(arguments)
    prepared, counts = prepare(Skin.load(options.skin)), Counts()
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "arm.urdf").write_text(ARM)
        (Path(folder) / "robot.toml").write_text(ROBOT.format(skin=options.skin))
        robot = Robot.load(Path(folder) / "robot.toml")
    for seed in range(options.seed, options.seed + options.rigs):
        counts += counted(prepared, robot, seed, options.seconds)
    found = {}
    for who in (OWN, OTHER):
        marks = {mark: n for (made_by, mark), n in counts.items() if made_by == who}
        found[who] = float(sum(marks.values()))
        found[f"{who}, marked"] = marks.get(True, 0) / found[who]
    for name, value in found.items():
        print(f"{name:<14} {value:.4g}")
    return found


if __name__ == "__main__":
    main()
