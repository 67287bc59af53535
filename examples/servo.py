"""Contact servo: a pad that wears a skin follows a finger by touch, as a policy learnt it.

A finger wanders beside a pad and presses it. The pad moves so that the touch stays at one place of
the sheet and at one force. An expert that knows place and force shows how, on some sheets. Its
episodes are recorded and exported as a LeRobot dataset, a policy learns from that alone, and then
moves the pad on sheets that it has not met; once more with touch masked.

    python examples/servo.py --demonstrations 24 --episodes 50
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from tomoskin.core import FloatArray
from tomoskin.extras.lerobot import FIELDS, SLOTS, PolicyForms, PolicyView, write_lerobot
from tomoskin.extras.lerobot.dataset import PREFIX, TIME, utc_of
from tomoskin.files.exports import Export
from tomoskin.files.session import SessionReader, SessionWriter
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

SKIN = "textile-disc-8"
RATE = 18
"""Rows of the dataset a second: about the skin's frames."""

GOAL, FORCE = np.array([0.02, -0.01]), 4.0
"""Where the touch is to be on the sheet, m, and its force, N."""

STIFFNESS = 1000.0
"""Of the pad, N/m."""

RADIUS = 0.012
"""Of the finger, m."""

FASTEST = np.array([0.06, 0.06, 0.008])
"""Of the pad along x and y and towards the finger, m/s."""

GAIN = 10.0
"""Of the expert, 1/s."""

STEPS, WARM_UP, REST = 70, 35, 20
"""Scans of an episode, those after which it counts, and those without a touch before it."""

NEAR, ABOUT = 0.012, 0.4
"""In place is within so many m, and at the force within this part of it."""

KEPT = 0.8
"""Part of the scans that count in which the touch must be well for a success."""

EDGE = 0.075
"""Farthest that a touch can be from the middle of the sheet, m."""

SHEETS, OTHERS = 12, 2000
"""Sheets of the demonstrations, and the seed of the first of the others."""

Policy = Callable[[PolicyView, "World"], FloatArray]


@dataclass
class World:
    """A finger and a pad: where the finger is against the pad, m, and how deep it presses, m."""

    rng: np.random.Generator
    touch: FloatArray = field(init=False)
    depth: float = field(init=False)

    def __post_init__(self) -> None:
        """Begin somewhere else than at the goal."""
        angle = self.rng.uniform(0, 2 * np.pi)
        self.touch = 0.035 * np.array([np.cos(angle), np.sin(angle)])
        self.depth = self.rng.uniform(1.5, 7.0) / STIFFNESS
        self._way = self.rng.normal(0, 0.012, 2)
        self._sink = 0.0

    @property
    def force(self) -> float:
        """N of the finger on the pad."""
        return STIFFNESS * self.depth

    @property
    def press(self) -> Sequence[Press]:
        """What presses on the sheet."""
        if self.force < 0.05:
            return ()
        return (Press(*self.touch.tolist(), force=self.force, radius=RADIUS),)

    @property
    def is_well(self) -> bool:
        """Whether the touch is in place and at its force."""
        in_place = np.hypot(*(self.touch - GOAL)) < NEAR
        return bool(in_place and abs(self.force - FORCE) < ABOUT * FORCE)

    def move(self, action: FloatArray, seconds: float) -> None:
        """The finger wanders on; the pad goes as it is told, m/s, as fast as it can."""
        self._way += self.rng.normal(0, 0.02, 2) * np.sqrt(seconds) - 0.5 * self._way * seconds
        self._sink += self.rng.normal(0, 0.0008) * np.sqrt(seconds) - 0.5 * self._sink * seconds
        speed = np.clip(action, -FASTEST, FASTEST)
        touch = self.touch + (self._way - speed[:2]) * seconds
        self.touch = touch * min(1.0, EDGE / np.hypot(*touch))
        depth = self.depth + (self._sink + speed[2]) * seconds
        self.depth = float(np.clip(depth, 0.0, 0.009))


def expert(_: PolicyView, world: World) -> FloatArray:
    """What one does who knows place and force."""
    return GAIN * np.array([*(world.touch - GOAL), (FORCE - world.force) / STIFFNESS])


@dataclass(frozen=True)
class Moment:
    """One scan: when it was, what was done then, and how the world was."""

    time: float
    action: FloatArray
    is_well: bool


def episode(
    twin: SteppedSkin, forms: PolicyForms, seed: int, act: Policy, shake: float = 0.0
) -> Iterator[Moment]:
    """Follow one finger. The pad is shaken, so that who watches sees how to come back."""
    world = World(np.random.default_rng(seed))
    for _ in range(STEPS):
        view = scanned(twin, forms, world.press)
        action = act(view, world)
        yield Moment(view.time, action, world.is_well)
        world.move(action + shake * FASTEST * world.rng.normal(0, 0.3, 3), twin.period)


def scanned(twin: SteppedSkin, forms: PolicyForms, press: Sequence[Press]) -> PolicyView:
    """One scan under a press, as a policy sees it."""
    twin.step(press)
    assert twin.result is not None
    forms.push(twin.result)
    view = forms.at()
    assert view is not None
    return view


def sheet_of(prepared: Prepared, seed: int) -> tuple[SteppedSkin, PolicyForms]:
    """Another sheet with its electronics, and the forms of its touch."""
    twin = SteppedSkin(prepared, TwinSettings.preset("textile", seed))
    return twin, PolicyForms(prepared, count=1, newtons=False)


def demonstrated(prepared: Prepared, folder: Path, seed: int, count: int) -> Path:
    """A LeRobot dataset of the expert's episodes on one sheet, with its actions beside it."""
    twin, forms = sheet_of(prepared, seed)
    path, out = folder / f"{seed}.mcap", folder / f"{seed}.lerobot"
    moments: list[Moment] = []
    with SessionWriter(path, prepared.skin) as writer:
        for number in range(count):
            for _ in range(REST):
                scanned(twin, forms, ())
                writer.frame(twin.frame)
            done = []
            for moment in episode(twin, forms, 100 * seed + number, expert, shake=1.0):
                writer.frame(twin.frame)
                done.append(moment)
            writer.note(done[0].time, "episode follow the finger")
            writer.note(done[-1].time, "end")
            moments += done
    with SessionReader(path) as session:
        write_lerobot(Export(session, 1 / RATE), out)
    times, actions = np.array([m.time for m in moments]), np.array([m.action for m in moments])
    np.savez(out / "actions.npz", times=times, actions=actions)
    return out


def examples(dataset: Path) -> tuple[FloatArray, FloatArray]:
    """(rows, features) and (rows, 3) what the expert did then."""
    names = [f"{PREFIX}.{name}" for name in ("touches", "voltages")]
    table = pq.read_table(dataset / "data/chunk-000/file-000.parquet", columns=[*names, TIME])
    touches, voltages = (np.array(table[name].to_pylist()) for name in names)
    with np.load(dataset / "actions.npz") as held:
        moments = utc_of(np.array(table[TIME].to_pylist())) + 1e-6
        action = held["actions"][held["times"].searchsorted(moments, side="right") - 1]
    rows = [
        features_of(slots.reshape(SLOTS, len(FIELDS)), change)
        for slots, change in zip(touches, voltages, strict=True)
    ]
    return np.array(rows), action


def features_of(slots: FloatArray, change: FloatArray) -> FloatArray:
    """Where the first touch is, and its strength, with their products; 0 without a touch."""
    held = slots[slots[:, FIELDS.index("present")] > 0]
    if not len(held):
        return np.zeros(_FEATURES)
    x, y, strength = held[0][[FIELDS.index(name) for name in ("x", "y", "strength")]]
    size = np.sqrt(1e3 * np.abs(change).sum())
    own = np.array([1.0, 20 * x, 20 * y, 10 * strength, size])
    second = np.outer(own, own)[np.triu_indices(len(own))]
    return np.outer(second, own)[:, [0, 3, 4]].ravel()


_FEATURES = 45


def fitted(rows: FloatArray, actions: FloatArray) -> FloatArray:
    """(features, 3): actions that are linear in the features, by ridge regression."""
    scale = rows.std(axis=0) + 1e-9
    scaled = rows / scale
    square = scaled.T @ scaled + 1e-3 * len(rows) * np.eye(rows.shape[1])
    return np.asarray(np.linalg.solve(square, scaled.T @ actions) / scale[:, None])


def learnt(matrix: FloatArray) -> Policy:
    """The policy: it needs what it feels, and nothing of the world."""
    return lambda view, _: np.asarray(features_of(view.slots, view.window[-1]) @ matrix)


def masked(policy: Policy) -> Policy:
    """The same policy that feels nothing."""
    return lambda view, world: policy(
        replace(view, slots=0 * view.slots, window=0 * view.window), world
    )


def successes(prepared: Prepared, policies: Sequence[Policy], count: int) -> list[float]:
    """Part of the episodes in which each policy keeps the touch, each on a sheet of its own."""
    well = np.zeros((count, len(policies)))
    for number in range(count):
        twin, forms = sheet_of(prepared, OTHERS + number)
        for place, policy in enumerate(policies):
            for _ in range(REST):
                scanned(twin, forms, ())
            moments = list(episode(twin, forms, OTHERS + number, policy))
            well[number, place] = np.mean([m.is_well for m in moments[WARM_UP:]]) >= KEPT
    return [float(part) for part in well.mean(axis=0)]


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Demonstrate, learn, and follow on other sheets."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--demonstrations", type=int, default=24, help="episodes of the expert")
    parser.add_argument("--episodes", type=int, default=50, help="episodes on other sheets")
    options = parser.parse_args(arguments)
    prepared, each = prepare(Skin.load(SKIN)), max(1, options.demonstrations // SHEETS)
    with tempfile.TemporaryDirectory() as folder:
        held = [demonstrated(prepared, Path(folder), seed, each) for seed in range(1, SHEETS + 1)]
        rows, actions = map(np.concatenate, zip(*map(examples, held), strict=True))
    policy = learnt(fitted(rows, actions))
    parts = successes(prepared, [policy, masked(policy), expert], options.episodes)
    found = {
        "rows": float(len(rows)),
        **dict(zip(("touch", "masked", "expert"), parts, strict=True)),
    }
    for name, value in found.items():
        print(f"{name:<8} {value:.3g}")
    return found


if __name__ == "__main__":
    main()
