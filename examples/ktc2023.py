"""Kuopio Tomography Challenge 2023: plastic and metal in a water tank, found without a person.

    python examples/ktc2023.py DATA [--truth FOLDER] [--level N ...] [--figure FILE [--force]]

DATA is a folder of the challenge's files (ref.mat and data1.mat, data2.mat, …) or an .npz with
the same arrays. Level n leaves out what touches the first 2(n − 1) electrodes. Prints the score of
each sample and level where there is a truth, beside a linear method and a picture of water only.

The tank (Räsänen et al., 23 cm, 32 electrodes) has faults, which are measured on water: channels
let some of the common voltage through, and each electrode has its contact impedance.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.ndimage import gaussian_filter, label
from scipy.spatial import cKDTree

from tomoskin import core
from tomoskin.core import CHANGE, DataError, FloatArray, TomoskinError
from tomoskin.extras import absolute
from tomoskin.extras.absolute import AbsoluteImaging, Observation, Segmented, ShapeImaging
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, ElectrodeArc, Mesh, triangulate
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import Matern

Labels = NDArray[np.uint8]
WATER, RESISTIVE, CONDUCTIVE = 0, 1, 2
PIXELS = 256

RADIUS, N_ELECTRODES, WIDTH = 0.115, 32, 0.0125
"""The tank, and its electrodes' width as the voltages of water tell it, m."""

CELLS = 2000
SIGMA, CONTACT = 0.73, 3e-4
"""Water, S, and a usual contact impedance, Ω·m: where the fit to the reference begins."""

LENGTH = 0.025
"""Correlation length of shapes, m: about half a target's width."""

DRIFT = 0.2
"""Change of the water between reference and target, relative."""

SMALLEST = 200
"""Pixels: a smaller region, 14 mm across, is below what the electrodes resolve."""

REFERENCE_NOISE, REFERENCE_TOUCHED = 5e-3, 0.17
"""What the model leaves unexplained of water, V, and where a driven electrode is read."""

NOISE, OF_CHANGE, OF_VOLTAGE = 2.4e-3, 0.14, 0.032
"""The same of a change: V, parts of the change and of the reference's voltage; four times what the
true targets leave, which is alike in many rows."""


# The challenge's score.


def score(labels: NDArray[Any], truth: NDArray[Any]) -> float:
    """Half the similarity of what is conductive, half that of what is resistive; 1 is best."""
    kinds = (CONDUCTIVE, RESISTIVE)
    return float(np.mean([similarity(labels == kind, truth == kind).mean() for kind in kinds]))


def similarity(one: NDArray[Any], other: NDArray[Any]) -> FloatArray:
    """(256, 256) structural similarity of masks, in windows of 80 pixels (Wang et al. 2004)."""
    blur = partial(gaussian_filter, sigma=80.0, truncate=2.0, mode="constant")
    a, b, share = one.astype(np.float64), other.astype(np.float64), blur(np.ones(one.shape))
    ma, mb, both = (blur(mask) / share for mask in (a, b, a * b))
    light = (2.0 * ma * mb + 1e-4) / (ma**2 + mb**2 + 1e-4)
    spread = ma - ma**2 + mb - mb**2 + 9e-4  # of a mask the square is the mask
    return np.asarray(light * (2.0 * (both - ma * mb) + 9e-4) / spread)


# The tank.


@cache
def tank() -> Mesh:
    """Electrode 0 at the top, the others counter-clockwise."""
    rim = Disc(RADIUS)
    centres = (0.25 + np.arange(N_ELECTRODES) / N_ELECTRODES) * rim.length
    return triangulate(rim, [ElectrodeArc.around(float(c), WIDTH) for c in centres], CELLS)


@cache
def resistances() -> Pattern:
    """Every pair of electrodes against the last one: all that currents and voltages can tell."""
    i, j = np.triu_indices(N_ELECTRODES - 1)
    last = np.full(len(i), N_ELECTRODES - 1)
    return Pattern.from_tables(np.column_stack([i, last]), np.column_stack([j, last]))


@cache
def model() -> ForwardModel:
    """Of 1 A, so that the pattern's voltages are resistances."""
    return ForwardModel(tank(), resistances(), CONTACT)


@cache
def pixels(count: int) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Centres (n, 2) m of the pixels in the tank, of ``count`` a side, and which those are."""
    step = (np.arange(count) + 0.5) / count * 2 - 1
    x, y = np.meshgrid(RADIUS * step, -RADIUS * step)
    inside = np.hypot(x, y) < RADIUS
    return np.column_stack([x[inside], y[inside]]), inside


@dataclass(frozen=True, eq=False)
class Readout:
    """Which currents were driven and which voltages read; row 31·injection + measurement.

    Attributes
    ----------
    inj
        (32, n) mA of each electrode.
    mpat
        (32, k) what each measurement is of the electrodes' potentials.
    keep
        (n·k,) bool: rows that count.
    """

    inj: FloatArray
    mpat: FloatArray
    keep: NDArray[np.bool_]

    @property
    def channel(self) -> NDArray[np.int64]:
        """Measurement of each row that counts."""
        return np.asarray(np.tile(np.arange(self.mpat.shape[1]), self.inj.shape[1])[self.keep])

    @property
    def touched(self) -> NDArray[np.bool_]:
        """Whether a row that counts reads a driven electrode."""
        return np.asarray(((self.inj != 0).T @ (self.mpat != 0)).ravel()[self.keep])

    def rows(self, leak: FloatArray) -> FloatArray:
        """(rows, resistances): each value from the resistances, with ``leak`` (k,) V per V."""
        return self._between() + leak[self.channel, None] * self.common()

    def common(self) -> FloatArray:
        """The same for the common voltage of a row: of its electrodes, over the sink's."""
        half = np.abs(self.mpat).T / 2.0
        sink = np.maximum(-self.inj, 0.0)
        at = half[None] - (sink / sink.sum(axis=0)).T[:, None]
        return self._rows(at)

    def slopes(self, x: FloatArray, y: FloatArray, noise: FloatArray) -> FloatArray:
        """(k,) of y over x through the origin, channel by channel; 0 where nothing is read."""
        k = self.mpat.shape[1]
        product, square = (np.bincount(self.channel, x * v / noise**2, k) for v in (y, x))
        return np.asarray(product / np.where(square > 0, square, 1.0))

    def _between(self) -> FloatArray:
        return self._rows(np.broadcast_to(self.mpat.T, (self.inj.shape[1], *self.mpat.T.shape)))

    def _rows(self, at: FloatArray) -> FloatArray:
        """From what each row reads of the potentials, (n, k, 32)."""
        i, j = np.triu_indices(N_ELECTRODES - 1)
        drive = self.inj.T[:, None]
        twice = at[..., i] * drive[..., j] + at[..., j] * drive[..., i]
        return (twice * np.where(i == j, 0.5, 1.0)).reshape(-1, len(i))[self.keep]


# From voltages to labels.


def segment(
    u: NDArray[Any],
    u_ref: NDArray[Any],
    inj: NDArray[Any],
    mpat: NDArray[Any],
    keep: NDArray[Any] | None = None,
) -> Labels:
    """Labels (256, 256) of a tank: 0 water, 1 resistive, 2 conductive; row 0 at the top.

    Parameters
    ----------
    u, u_ref
        (n·k,) V with targets and of water only; rows that are not finite do not count.
    inj
        (32, n) mA.
    mpat
        (32, k).
    keep
        (n·k,) bool, rows that count; without it, all.
    """
    return labelled(regions(*checked(u, u_ref, inj, mpat, keep)))


def regions(readout: Readout, u: FloatArray, u_ref: FloatArray) -> Segmented:
    """What was found in the tank, and where that is sure."""
    water, sigma, observation = observed(readout, u, u_ref)
    return ShapeImaging(water, LENGTH, drift=DRIFT)(observation, sigma)


def labelled(found: Segmented) -> Labels:
    """Labels (256, 256), without specks."""
    labels, (places, inside) = np.zeros((PIXELS, PIXELS), np.uint8), pixels(PIXELS)
    labels[inside] = found.at(places)
    return without_specks(labels)


def observed(
    readout: Readout, u: FloatArray, u_ref: FloatArray
) -> tuple[ForwardModel, float, Observation]:
    """The tank's model and its water, S, and what was measured of the targets."""
    water, leak, sigma = calibrate(readout, u_ref)
    rows, change = readout.rows(leak), u - u_ref
    noise = np.sqrt(NOISE**2 + (OF_CHANGE * change) ** 2 + (OF_VOLTAGE * u_ref) ** 2)
    expected = rows @ water.solve(sigma).voltages  # of water: the change alone is measured
    return water, sigma, Observation.of(expected + change, noise, rows)


def without_specks(labels: Labels) -> Labels:
    """Regions of fewer than ``SMALLEST`` pixels become water."""
    kept = labels.copy()
    for kind in (RESISTIVE, CONDUCTIVE):
        region, _ = label(labels == kind)
        small = np.bincount(region.ravel()) < SMALLEST
        kept[(region > 0) & small[region]] = WATER
    return kept


def calibrate(readout: Readout, u_ref: FloatArray) -> tuple[ForwardModel, FloatArray, float]:
    """Model with the contacts that water shows, leak of each channel (k,), and the water, S."""
    noise = np.where(readout.touched, REFERENCE_TOUCHED, REFERENCE_NOISE)
    leak, sigma, water = np.zeros(readout.mpat.shape[1]), SIGMA, model()
    plain, common = readout.rows(leak), readout.common()
    for _ in range(2):
        resistance = water.solve(sigma).voltages
        leak = readout.slopes(common @ resistance, u_ref - plain @ resistance, noise)
        rows = plain + leak[readout.channel, None] * common
        found = absolute.homogeneous(model(), Observation.of(u_ref, noise, rows), "each", sigma)
        sigma = found.background
        water = ForwardModel(tank(), resistances(), found.contact_impedance)
    return water, leak, sigma


def checked(
    u: NDArray[Any],
    u_ref: NDArray[Any],
    inj: NDArray[Any],
    mpat: NDArray[Any],
    keep: NDArray[Any] | None,
) -> tuple[Readout, FloatArray, FloatArray]:
    """Read-out and the rows that count. Raises DataError for arrays that do not fit together."""
    currents, reads = _real(inj, "inj"), _real(mpat, "mpat")
    for name, table in (("inj", currents), ("mpat", reads)):
        if table.ndim != 2 or len(table) != N_ELECTRODES:
            raise DataError(f"expected {name} of shape (32, n), got {table.shape}")
    n = currents.shape[1] * reads.shape[1]
    values, reference = _real(u, "u").ravel(), _real(u_ref, "u_ref").ravel()
    counts = np.ones(n, bool) if keep is None else np.asarray(keep, bool).ravel()
    if not len(values) == len(reference) == len(counts) == n:
        raise DataError(
            f"expected {n} rows, got {len(values)} of u, {len(reference)} of u_ref "
            f"and {len(counts)} of keep"
        )
    counts = counts & np.isfinite(values) & np.isfinite(reference)
    if not counts.any():
        raise DataError("no row counts")
    return Readout(currents, reads, counts), values[counts], reference[counts]


def _real(value: Any, name: str) -> FloatArray:
    raw = np.asarray(value)
    if raw.dtype.kind not in "biuf":
        raise DataError(f"expected real numbers, got {raw.dtype}", where=name)
    return raw.astype(np.float64)


# What it is compared with.


def linear(
    u: NDArray[Any],
    u_ref: NDArray[Any],
    inj: NDArray[Any],
    mpat: NDArray[Any],
    keep: NDArray[Any] | None = None,
) -> Labels:
    """One linear step with a smoothness prior, cut in three by Otsu's rule.

    The kind of method that the organisers give as reference: no calibration of the tank, noise
    of 0.05 % of each voltage and 0.01 % of the largest, and the largest class is water.
    """
    readout, u, u_ref = checked(u, u_ref, inj, mpat, keep)
    rows = readout.rows(np.zeros(readout.mpat.shape[1]))
    water = ForwardModel(tank(), resistances(), 1e-6)
    noise = 5e-4 * np.abs(u) + 1e-4 * np.abs(u).max()
    sigma = absolute.homogeneous(
        water, Observation.of(u_ref, noise, rows), "fixed", SIGMA
    ).background
    imaging = AbsoluteImaging(water, Matern(RADIUS, 0.5), alpha=16.0, steps=1)
    expected = rows @ water.solve(sigma).voltages
    image = imaging(Observation.of(expected + u - u_ref, noise, rows), sigma).conductivity
    places, inside = pixels(PIXELS)
    picture = np.full((PIXELS, PIXELS), sigma)
    picture[inside] = image.values[cKDTree(tank().centroids).query(places)[1]]
    return _by_otsu(picture)


def _by_otsu(picture: FloatArray) -> Labels:
    """Two thresholds that leave the least variance within three classes (Otsu 1979)."""
    count, edge = np.histogram(picture, bins=PIXELS)
    centre = (edge[1:] + edge[:-1]) / 2.0
    weight = np.append(0.0, np.cumsum(count))
    moment = np.append(0.0, np.cumsum(count * centre))
    low, high = np.triu_indices(PIXELS + 1, 1)
    between = sum(
        (moment[b] - moment[a]) ** 2 / np.maximum(weight[b] - weight[a], 1.0)
        for a, b in ((np.zeros_like(low), low), (low, high), (high, np.full_like(high, PIXELS)))
    )
    best = int(np.argmax(between))
    classes = np.digitize(picture, [edge[low[best]], edge[high[best]]])
    water = int(np.bincount(classes.ravel(), minlength=3).argmax())
    return np.where(
        classes < water, RESISTIVE, np.where(classes > water, CONDUCTIVE, WATER)
    ).astype(np.uint8)


# The challenge's files.


@dataclass(frozen=True, eq=False)
class Sample:
    """One target: what was measured with and without it, and the truth where it is known."""

    name: str
    u: FloatArray
    u_ref: FloatArray
    inj: FloatArray
    mpat: FloatArray
    truth: NDArray[Any] | None


def kept(inj: FloatArray, mpat: FloatArray, level: int) -> NDArray[np.bool_]:
    """(n·k,) bool: rows of a difficulty, which do without the first 2(level − 1) electrodes."""
    lost = slice(0, 2 * (level - 1))
    drive, read = (inj[lost] != 0).any(axis=0), (mpat[lost] != 0).any(axis=0)
    return np.asarray((~drive[:, None] & ~read).ravel())


def samples(data: Path, truth: Path | None = None) -> Iterator[Sample]:
    """Samples of an .npz or of a folder of .mat files.

    ``truth`` is a folder of .mat files with one picture each, in the order of the samples.
    Raises DataError when there are none, or a file lacks something.
    """
    if data.is_file():
        yield from _packed(data)
        return
    found = sorted(data.glob("data*.mat"))
    if not found or not (data / "ref.mat").exists():
        raise DataError("expected ref.mat and data1.mat, …", where=str(data))
    pictures = sorted(truth.glob("*.mat")) if truth else []
    if pictures and len(pictures) != len(found):
        raise DataError(f"expected {len(found)} truths, got {len(pictures)}", where=str(truth))
    reference = _arrays(data / "ref.mat")
    u_ref = _one_of(reference, data / "ref.mat", "Uelref", "Uel").ravel()
    for i, file in enumerate(found):
        held = _arrays(file)
        yield Sample(
            file.stem,
            _one_of(held, file, "Uel").ravel(),
            u_ref,
            _one_of(held, file, "Inj"),
            _one_of(held, file, "Mpat"),
            _one_of(_arrays(pictures[i]), pictures[i], "truth") if pictures else None,
        )


def _packed(file: Path) -> Iterator[Sample]:
    try:
        with np.load(file) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception as error:  # as many kinds of errors as kinds of damage
        raise DataError(f"is not an .npz that can be read: {error}", where=str(file)) from error
    u_ref, inj, mpat = (_one_of(arrays, file, name) for name in ("U_ref", "inj", "mpat"))
    truths = arrays.get("truth")
    for i, u in enumerate(_one_of(arrays, file, "U")):
        yield Sample(f"{i + 1}", u, u_ref, inj, mpat, None if truths is None else truths[i])


def _arrays(file: Path) -> dict[str, Any]:
    try:
        return dict(loadmat(file))
    except Exception as error:  # scipy makes all sorts of errors of damaged files
        raise DataError(f"is not a .mat file that can be read: {error}", where=str(file)) from error


def _one_of(arrays: dict[str, Any], file: Path, *names: str) -> FloatArray:
    for name in names:
        if name in arrays:
            return _real(arrays[name], f"{file}, {name}")
    raise DataError(f"expected {' or '.join(names)}, got {sorted(arrays)}", where=str(file))


# The command line.

COLOURS = CHANGE.table[[len(CHANGE.table) // 2, 0, -1]]
"""Water, resistive, conductive."""


@dataclass(frozen=True, eq=False)
class Scored:
    """One sample at one level: labels, their score, those of a linear step and of water only."""

    sample: Sample
    level: int
    labels: Labels
    seconds: float
    scores: tuple[float, float, float] | None


def scored(sample: Sample, level: int) -> Scored:
    """Segment, and compare where there is a truth."""
    arrays = (sample.u, sample.u_ref, sample.inj, sample.mpat)
    keep = kept(sample.inj, sample.mpat, level)
    begun = time.process_time()
    labels = segment(*arrays, keep)
    seconds = time.process_time() - begun
    if sample.truth is None:
        return Scored(sample, level, labels, seconds, None)
    others = linear(*arrays, keep), np.zeros_like(labels)
    scores = [score(picture, sample.truth) for picture in (labels, *others)]
    return Scored(sample, level, labels, seconds, (scores[0], scores[1], scores[2]))


def draw(results: Sequence[Scored], file: Path, *, overwrite: bool) -> None:
    """Labels with the outline of the truth, samples down and levels across."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - an extra

    names = list(dict.fromkeys(r.sample.name for r in results))
    levels = sorted({r.level for r in results})
    size = (1.4 * len(levels) + 0.2, 1.6 * len(names))
    made = Figure(figsize=size, layout="constrained")
    axes = made.subplots(len(names), len(levels), squeeze=False)
    for r in results:
        ax = axes[names.index(r.sample.name), levels.index(r.level)]
        ax.imshow(COLOURS[r.labels], interpolation="nearest")
        if r.sample.truth is not None:
            ax.contour(r.sample.truth, [0.5, 1.5], colors="black", linewidths=0.7)
        tail = f": {r.scores[0]:.2f}" if r.scores else ""
        ax.set_title(f"{r.sample.name}, level {r.level}{tail}", fontsize=8)
        ax.set_axis_off()
    with core.written(file, overwrite=overwrite) as part:
        made.savefig(part, dpi=130)


def check_figure(chosen: argparse.Namespace) -> None:
    """Look where the figure is to go, before anything is segmented; raises OutputError."""
    read = [f for d in (chosen.data, chosen.truth or chosen.data) for f in (d, *d.glob("*.mat"))]
    endings = {".png": "a picture", ".pdf": "a figure", ".svg": "a drawing"}
    if chosen.figure:
        output = core.Output(chosen.figure, endings, "--figure")
        core.check_outputs([output], read, overwrite=chosen.force, consent="--force")


def main(arguments: Sequence[str] | None = None) -> list[Scored]:
    """Segment what the arguments name, print the table, draw the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="a folder of .mat files, or an .npz")
    parser.add_argument("--truth", type=Path, help="folder of the true pictures")
    parser.add_argument("--level", type=int, nargs="+", default=range(1, 8))
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--force", action="store_true", help="write over a figure that is there")
    chosen = parser.parse_args(arguments)
    check_figure(chosen)
    results = []
    print("sample   level  score  linear  water  seconds")
    for sample in samples(chosen.data, chosen.truth):
        for level in chosen.level:
            results.append(last := scored(sample, level))
            numbers = "".join(f"{s:7.3f}" for s in last.scores or ()) or " " * 21
            print(f"{sample.name:8} {level:5d} {numbers} {last.seconds:8.1f}", flush=True)
    if known := [r.scores for r in results if r.scores]:
        print("mean          ", "".join(f"{s:7.3f}" for s in np.mean(known, axis=0)))
    if chosen.figure:
        draw(results, chosen.figure, overwrite=chosen.force)
    return results


if __name__ == "__main__":
    try:
        main()
    except TomoskinError as error:
        sys.exit(f"ktc2023: {error}")
