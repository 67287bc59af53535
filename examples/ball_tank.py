"""A golf ball carried round a tank of salt water: recordings of EIDORS, by a model of its depth.

A tank 300 mm across with 16 electrodes in one plane (A. Adler, Ottawa 2005; sample data of EIDORS).
In a deep tank current spreads up and down, which a flat model cannot do. How deep the water is, the
empty tank's voltages say: they fall the faster around the ring, the deeper it is. A ball is looked
for in the electrodes' plane, where its change of the voltages explains most of what was measured.
The film's frames have no empty one. Their reference is the mean of all frames, after each
frame's ball has been taken out of it.

Shown: left the three placements, dashed where the ball was put; right a film of the carried ball.
The colours are a smooth change, the same at each depth; the cross is the ball that was found.
Thesis saw: nothing of the kind; its tanks are those of others.
Checked: the ball within 16 mm of where it was put, three times; in the film the ball explains more
than half of the change in half of the frames.
Assumed: that the ball insulates and lies in the electrodes' plane; the tank's size and the
places are those of the recording. The film has no truth to be compared with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.patches import Circle
from numpy.typing import NDArray
from PIL import Image
from scipy.special import expit

import figures
from figure_file import chosen, parser_of
from lab import report
from tomoskin.core import FloatArray, written
from tomoskin.extras.absolute import RandomField
from tomoskin.files.imports import read_recording
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, ElectrodeArc, extrude, ring, triangulate
from tomoskin.model.pattern import Pattern

RECORDINGS = Path(__file__).resolve().parents[2] / "shared" / "data" / "eidors_tanks16"
PLACED, CARRIED = "ottawa2005_golfball_ph3.npz", "ottawa2005_moving_ball_series.npz"

RADIUS, BALL, ELECTRODE = 0.15, 0.02, 0.01
"""Of the tank and the ball; width and height of an electrode, assumed; m."""

RIM, PATTERN, N = Disc(RADIUS), Pattern.adjacent(16), 16
DEPTHS = np.arange(0.15, 0.351, 0.025)
"""m of water that are tried, with the electrodes half-way up."""

EDGE, STEP = 0.003, 0.003
"""m over which a ball's edge is soft, since cells are not far smaller; m between places."""

EVERY, SHOWN, ROUNDS = 3, slice(66, 106), 3
"""Of the frames one in so many, those of the film, and how often their reference is made again."""

SMOOTH, QUIET = 0.03, 0.02
"""Correlation length of the pictures, m, and their noise: a part of the mean square signal."""


def tank(depth: float, cells: int, layers: int) -> ForwardModel:
    """Of 1 A; the pattern reads no driven electrode, so contacts do not matter."""
    low, high = (depth + np.array([-1, 1]) * ELECTRODE) / 2
    patches = ring(RIM, N, ELECTRODE, float(low), float(high))
    return ForwardModel(extrude(RIM, depth, patches, cells=cells, layers=layers), PATTERN, 1e-3)


def depth_of(empty: FloatArray) -> float:
    """m: the depth whose fall of the voltages around the ring is most like that of ``empty``."""
    away = (PATTERN.measure[:, 0] - PATTERN.drive[:, 0]) % N

    def fall(voltages: FloatArray) -> FloatArray:
        values = np.array([np.log(voltages[away == k]).mean() for k in range(1, N - 2)])
        return np.asarray(values - values.mean())

    wanted = fall(empty)
    misfit = [((fall(tank(d, 300, 6).solve(1.0).voltages) - wanted) ** 2).sum() for d in DEPTHS]
    best = int(np.clip(np.argmin(misfit), 1, len(DEPTHS) - 2))
    square, slope, _ = np.polyfit(DEPTHS[best - 1 : best + 2], misfit[best - 1 : best + 2], 2)
    return float(np.clip(-slope / (2 * square), DEPTHS[0], DEPTHS[-1]))


@dataclass(frozen=True, eq=False)
class Found:
    """A ball: place (2,) m, the part of the change that it explains, and its change (208,)."""

    place: FloatArray
    explained: float
    change: FloatArray


class Finder:
    """Finds one ball from relative changes (208,), in which a common gain does not count."""

    def __init__(self, depth: float) -> None:
        state = tank(depth, 500, 9).at(1.0)
        mesh, jacobian = state.model.mesh, state.jacobian
        side = np.arange(-RADIUS, RADIUS, STEP)
        places = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        self.places = places[np.hypot(*places.T) < RADIUS - BALL]
        # noise is the same in all rows, in volts
        self.weight = state.voltages / state.voltages.max()
        balls = np.array([_ball(mesh.centroids, (*xy, depth / 2)) for xy in self.places])
        self.changes = -(balls @ jacobian.T) / state.voltages
        weighted = self._levelled(self.changes)
        self.lengths = np.linalg.norm(weighted, axis=1)
        self.units = weighted / self.lengths[:, None]
        flat = [ElectrodeArc.around((0.25 - k / N) * RIM.length, ELECTRODE) for k in range(N)]
        self.mesh = triangulate(RIM, flat, 1500)
        self.field = RandomField.on(self.mesh, SMOOTH)
        by_field = jacobian @ self.field.at(mesh.centroids[:, :2]) / state.voltages[:, None]
        self.by_field = self._levelled(by_field.T).T

    def __call__(self, change: FloatArray) -> Found:
        """The ball that explains most of ``change``."""
        seen = self._levelled(change)
        along = np.maximum(self.units @ seen, 0.0)
        best = int(along.argmax())
        part = float(along[best] ** 2 / (seen @ seen))
        size = along[best] / self.lengths[best]
        return Found(self.places[best], part, size * self.changes[best])

    def picture(self, change: FloatArray) -> FloatArray:
        """(n_cells,) change of the conductivity, in parts, the same at each depth."""
        gram = self.by_field @ self.by_field.T
        noise = QUIET * np.trace(gram) / len(gram) * np.eye(len(gram))
        inner = np.linalg.solve(gram + noise, self._levelled(change))
        return np.asarray(self.field.basis @ (self.by_field.T @ inner))

    def _levelled(self, changes: FloatArray) -> FloatArray:
        """Weighted, and without what a common gain would do: (…, 208)."""
        gain = self.weight / np.linalg.norm(self.weight)
        weighted = changes * self.weight
        return np.asarray(weighted - (weighted @ gain)[..., None] * gain)


def _ball(centres: FloatArray, place: tuple[float, float, float]) -> NDArray[np.float32]:
    """Part of each cell that lies in a ball at ``place`` m, about."""
    away = np.linalg.norm(centres - np.array(place), axis=1)
    return np.asarray(expit((BALL - away) / EDGE), np.float32)


def carried(finder: Finder, frames: FloatArray) -> tuple[FloatArray, list[Found]]:
    """Relative changes (n, 208) of ``frames``, and the ball of each."""
    reference = frames.mean(axis=0)
    for _ in range(ROUNDS):
        balls = [finder(frame / reference - 1.0) for frame in frames]
        reference = np.mean(
            [frame / (1.0 + ball.change) for frame, ball in zip(frames, balls, strict=True)], axis=0
        )
    changes = frames / reference - 1.0
    return changes, [finder(change) for change in changes]


def voltages(data: Path, name: str) -> FloatArray:
    """(n_frames, 208) of a recording, in the instrument's unit."""
    return np.asarray(read_recording(data / name).in_order_of(PATTERN).voltages.real)


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Find the balls, draw the film; the numbers that were checked."""
    parser = parser_of(__doc__)
    parser.add_argument("--data", type=Path, default=RECORDINGS, help="folder of the recordings")
    options = chosen(parser, arguments, "ball_tank")
    empty, middle, north, both = voltages(options.data, PLACED)
    with np.load(options.data / PLACED) as file:
        put = 1e-3 * np.array([file["ball_xy_mm"][k, j] for k, j in ((1, 0), (2, 0), (3, 1))])
    depth = depth_of(empty)
    finder = Finder(depth)
    pairs = ((middle, empty), (north, empty), (both, north))
    placed = np.array([finder(after / before - 1.0).place for after, before in pairs])
    errors = np.linalg.norm(placed - put, axis=1)
    changes, balls = carried(finder, voltages(options.data, CARRIED)[::EVERY])
    explained = np.array([ball.explained for ball in balls])
    numbers = {
        "depth of the water, mm": 1e3 * depth,
        "error in the middle, mm": 1e3 * errors[0],
        "error in the north, mm": 1e3 * errors[1],
        "error in the west, mm": 1e3 * errors[2],
        "part of the carried ball's change explained, median": float(np.median(explained)),
    }
    assert errors.max() < 16e-3, f"a ball is placed {1e3 * errors.max():.1f} mm off"
    assert np.median(explained) > 0.5, "the carried ball explains too little of the change"
    film = draw(finder, np.stack([put, placed]), changes[SHOWN], balls[SHOWN])
    with written(options.figure.path, overwrite=options.figure.overwrite) as part:
        film[0].save(
            part, format="PNG", save_all=True, append_images=film[1:], duration=150, loop=0
        )
    return numbers


def draw(
    finder: Finder, placed: FloatArray, changes: FloatArray, balls: Sequence[Found]
) -> list[Image.Image]:
    """The film; ``placed`` is (2, 3, 2) m, where balls were put and where they were found."""
    made, ((left, right),) = figures.figure(1, 2, (6.4, 3.4))
    figures.draw_electrodes(left, finder.mesh)
    left.add_patch(Circle((0, 0), figures.MM * RADIUS, fill=False, color="0.6"))
    for put, found in placed.transpose(1, 0, 2):
        figures.mark_probe(left, figures.circle(*put, BALL))
        left.plot(*(figures.MM * found), "k+", markersize=9)
    left.set_title("placed one by one")
    pictures = np.array([finder.picture(change) for change in changes])
    limit = 0.8 * float(np.abs(pictures).max())
    way = figures.MM * np.array([ball.place for ball in balls])
    film = []
    for k, picture in enumerate(pictures):
        right.clear()
        figures.draw_map(right, finder.mesh, picture, limit)
        right.plot(*way[max(0, k - 8) : k + 1].T, "-", color="0.2", linewidth=0.9)
        right.plot(*way[k], "k+", markersize=9, markeredgewidth=1.4)
        right.set_title(f"carried round, frame {EVERY * (SHOWN.start + k)}")
        made.canvas.draw()
        film.append(Image.fromarray(np.array(made.canvas.buffer_rgba())[..., :3]))
    return film


if __name__ == "__main__":
    report(main())
