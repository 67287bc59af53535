"""A reflex: an arm whose forearm wears a skin draws back from what touches it.

A planar arm of two links stands beside the twin of a skin, which is pressed at random places. At
each frame the arm's joints are told a speed: that at which the touched point goes away from the
touch, against the skin's normal. Who presses lets go once the point has gone 10 mm. Said is how
long each command comes after its contact.

    python examples/reflex.py --skin textile-disc-8 --presses 20
"""

from __future__ import annotations

import argparse
import math
import queue
import statistics
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tomoskin.core import FloatArray, WallClock
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import LiveSkin, Runner
from tomoskin.run.sinks import Contacts
from tomoskin.twin import Press, TwinSettings, TwinTransport, make_twin

LINKS = (0.30, 0.25)
"""Lengths of upper arm and forearm, m; the skin lies on the middle of the forearm."""

SPEED = 0.25
"""Of the touched point, m/s."""

AWAY = 0.010
"""How far a point goes before who presses lets go, m."""

WAIT = 0.1
"""Seconds after which the loop goes on without a new frame."""

PATIENCE = 30.0
"""Seconds in which a press must be answered."""


@dataclass
class Arm:
    """Two links in a plane; ``angles`` of shoulder and elbow, rad."""

    angles: FloatArray = field(default_factory=lambda: np.array([0.6, 0.9]))

    def jacobian(self, along: float) -> FloatArray:
        """(2, 2) m: how a point ``along`` the forearm moves with the angles."""
        upper, fore = self.angles[0], self.angles.sum()
        arm = along * np.array([-math.sin(fore), math.cos(fore)])
        elbow = LINKS[0] * np.array([-math.sin(upper), math.cos(upper)])
        return np.column_stack([elbow + arm, arm])

    def normal(self) -> FloatArray:
        """(2,) away from the forearm's outer side."""
        fore = self.angles.sum()
        return np.array([-math.sin(fore), math.cos(fore)])

    def retreat(self, along: float) -> FloatArray:
        """(2,) rad/s at which a point goes against the normal at :data:`SPEED`.

        The least speeds that do so: along the forearm the point may go as it likes.
        """
        row = self.normal() @ self.jacobian(along)
        return np.asarray(-SPEED * row / (row @ row))


class Reflex:
    """Tells the arm what to do at each frame, and when a touch was first answered."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.answers: queue.SimpleQueue[float] = queue.SimpleQueue()
        self.ready, self.away, self.free = (threading.Event() for _ in range(3))
        self.gone = 0.0
        self._last: float | None = None

    def react(self, contacts: Contacts) -> None:
        """Command the joints; called with each frame."""
        if not contacts.valid:
            return
        speed = np.zeros(2)
        if contacts.touches:
            speed = self.arm.retreat(LINKS[1] / 2 + contacts.touches[0].position[0])
            if self.free.is_set():  # the first frame of a touch
                self.answers.put(time.monotonic())
                self.free.clear()
        else:
            self.free.set()
            self.gone = 0.0
        self._move(speed, contacts.host_time)
        self.ready.set()

    def _move(self, speed: FloatArray, now: float) -> None:
        """Go on as commanded since the frame before."""
        passed = 0.0 if self._last is None else now - self._last
        self._last = now
        self.arm.angles = self.arm.angles + passed * speed
        self.gone += SPEED * passed * bool(speed.any())
        if self.gone >= AWAY:
            self.away.set()


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Press, and say how fast the arm was."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--skin", default="textile-disc-8", help="built-in name or path")
    parser.add_argument("--presses", type=int, default=20, help="how many")
    parser.add_argument("--seed", type=int, default=1, help="of the twin and of the places")
    options = parser.parse_args(arguments)
    found = measured(Skin.load(options.skin), options.presses, options.seed)
    for name, value in found.items():
        print(f"{name:<24} {value:.1f}")
    return found


def measured(skin: Skin, presses: int, seed: int) -> dict[str, float]:
    """Times of so many presses, ms, and how many were answered."""
    twin = make_twin(skin, TwinSettings.preset("textile", seed), WallClock())
    reflex, frames, ended = Reflex(Arm()), [], threading.Event()
    runner = Runner(prepare(skin), lambda: twin)

    def control() -> None:
        while not ended.is_set():
            contacts = live.wait(WAIT)
            frames.append((contacts.host_time, contacts.age_s))
            reflex.react(contacts)

    with LiveSkin(runner) as live:
        runner.start()
        loop = threading.Thread(target=control)
        loop.start()
        try:
            reflex.ready.wait(PATIENCE)
            times = [time_of(reflex, twin, where) for where in places_on(skin, presses, seed)]
        finally:
            ended.set()
            loop.join()
    answered = [1e3 * value for value in times if value is not None]
    host_times, ages = np.array(frames[1:]).T
    return {
        "presses": presses,
        "answered": len(answered),
        "one scan, ms": 1e3 * float(np.median(np.diff(host_times))),
        "age of contacts, ms": 1e3 * float(np.median(ages)),
        "contact to command, ms": statistics.median(answered),
        "the slowest, ms": max(answered),
    }


def places_on(skin: Skin, count: int, seed: int) -> FloatArray:
    """(count, 3): x and y in the inner half of a skin, m, and a moment to wait, s."""
    low, high = skin.mesh().points.min(axis=0), skin.mesh().points.max(axis=0)
    share = np.random.default_rng(seed).random((count, 3))
    middle, width = (low + high) / 2, (high - low) / 2
    return np.column_stack([middle + width * (share[:, :2] - 0.5), 0.1 + 0.1 * share[:, 2]])


def time_of(reflex: Reflex, twin: TwinTransport, where: FloatArray) -> float | None:
    """Seconds from a press to its command; None where none came."""
    x, y, pause = where
    reflex.free.wait(PATIENCE)
    threading.Event().wait(pause)  # any moment of a scan is as likely
    reflex.away.clear()
    twin.set_presses((Press(x, y, force=5.0, radius=0.012),))  # solved when it returns
    begun = time.monotonic()
    try:
        answer = reflex.answers.get(timeout=PATIENCE)
    except queue.Empty:
        return None
    finally:
        reflex.away.wait(PATIENCE)
        twin.set_presses(())
    return answer - begun


if __name__ == "__main__":
    main()
