"""Tanks of others: what is found in recordings of boards and rigs that are not ours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.sparse import csr_array

from report import Report, recordings, table
from tomoskin import Skin
from tomoskin.core import FloatArray
from tomoskin.extras.instruments.tables import touches_drive
from tomoskin.extras.instruments.text_logs import rows_of
from tomoskin.files.imports import read_recording, voltages_of
from tomoskin.model.mesh import Mesh
from tomoskin.pipeline import prepare, reconstruct
from tomoskin.sensing.signal import Recording

NEAR, SHOWN = 0.25, 0.35
"""An object is found within the first of the tank's radius; what is above the second of the
image's greatest change and farther from all of them is a ghost."""

LAMBDA = 0.3
"""Of the plain NOSER."""

TABLES = "rigs_of_others"


@dataclass(frozen=True, eq=False)
class Rig:
    """A recording with its truth: objects of each frame in radii, or the angle of each frame, rad.

    ``sign`` is that of the object which is turned; ``chosen`` says whether a default was chosen
    by it, and ``first`` where E1 is, rad.
    """

    name: str
    recording: Recording
    width: float
    objects: tuple[FloatArray, ...] = ()
    angle: FloatArray | None = None
    sign: int = 0
    chosen: bool = False

    def skin(self, method: str) -> Skin:
        """A tank of 1 m in radius with the recording's rows; its size and unit do not count."""
        rows = self.recording
        n = 1 + int(max(rows.drive.max(), rows.measure.max()))
        text = f"""format = 1
        [skin]
        name = "tank"
        [outline]
        shape = "disc"
        diameter = "2000 mm"
        [electrodes]
        count = {n}
        width = "{1000 * self.width:.3f} mm"
        contact_impedance = "0.02 ohm*m"
        [material]
        sheet_resistance = "1 ohm/sq"
        [drive]
        current = "1 A"
        drive = {rows.drive.tolist()}
        measure = {rows.measure.tolist()}
        [inverse]
        method = "{method}"
        [touch]
        method = "image"
        sign = "both"
        """
        return Skin.from_toml(text)


def rigs(data: Path | None) -> Iterator[Rig]:
    """All of them. GREIT's radius alone was chosen by the even tanks of KIT4."""
    folder = recordings(data, f"{TABLES}/kit4_tank16.npz")
    tank = folder / "eidors_tanks16"
    yield _kuopio(folder / "ktc2023_tank32" / "train.npz")
    balls = read_recording(tank / "ottawa2005_golfball_ph3.npz")
    with np.load(tank / "ottawa2005_golfball_ph3.npz") as arrays:
        at = [xy[np.isfinite(xy).all(axis=1)] / 150.0 for xy in arrays["ball_xy_mm"]]
    yield Rig("golf balls", balls.part(0, 4), 0.067, tuple(at), chosen=True)
    for name in ("montreal1995_rod_circle", "iirc2006_rotating_rod"):
        turned = _phased(read_recording(tank / f"{name}.npz"))
        angle = np.linspace(0.0, 2.0 * np.pi, len(turned))
        yield Rig(name, turned, 0.067, angle=angle, chosen=True)
    kit4 = read_recording(folder / TABLES / "kit4_tank16.npz")
    with np.load(folder / TABLES / "kit4_tank16.npz") as arrays:
        objects = arrays["objects"]
    for odd, count in product((0, 1), (1, 4)):
        cases = range(odd, len(kit4), 2)
        every = replace(kit4, voltages=kit4.voltages[odd::2], time=kit4.time[odd::2])
        rows = _skips(every, count)
        name = f"KIT4, {'odd' if odd else 'even'} tanks, {rows.voltages.shape[1]} rows"
        at = tuple(objects[objects[:, 0] == case, 2:] for case in cases)
        yield Rig(name, rows, 25 / 140, at, chosen=not odd)
    yield _turned(folder, "triangle", -1)
    yield _turned(folder, "cylinder", 1)


def _kuopio(path: Path) -> Rig:
    recording = read_recording(path)
    with np.load(path) as arrays:
        truth = arrays["truth"]
    kept = ~touches_drive(recording.drive, recording.measure)
    return Rig(
        "Kuopio 2023", _rows(recording, kept), 12.5 / 115, tuple(map(_middles, truth)), chosen=True
    )


def _middles(truth: NDArray[Any]) -> FloatArray:
    """(n, 2) middles of what is in a tank, in radii; specks do not count."""
    found = []
    for kind in (1, 2):
        parts, count = label(truth == kind)
        for part in range(1, count + 1):
            row, column = np.nonzero(parts == part)
            if len(row) > 200:
                found.append([(column + 0.5).mean() / 128 - 1, 1 - (row + 0.5).mean() / 128])
    return np.array(found).reshape(-1, 2)


def _turned(folder: Path, name: str, sign: int) -> Rig:
    with np.load(folder / TABLES / f"turned_{name}16.npz") as arrays:
        values, empty, angle = arrays["magnitudes"], arrays["empty"], arrays["angle_deg"]
    recording = voltages_of(name, values, rows_of(values.shape[1]), reference=empty)
    once = recording.without_repeats()
    return Rig(f"turned {name}", once, 0.1, angle=np.deg2rad(angle), sign=sign)


def _skips(recording: Recording, count: int) -> Recording:
    """Rows whose pair is not driven, of the first ``count`` ways of skipping electrodes."""
    apart = np.abs(np.subtract(*recording.drive.T))
    kept = np.minimum(apart, 16 - apart) <= count
    return _rows(recording, kept & ~touches_drive(recording.drive, recording.measure))


def _rows(recording: Recording, kept: NDArray[np.bool_]) -> Recording:
    reference = recording.reference
    return replace(
        recording,
        voltages=recording.voltages[:, kept],
        drive=recording.drive[kept],
        measure=recording.measure[kept],
        reference=None if reference is None else reference[kept],
    )


def _phased(recording: Recording) -> Recording:
    """Real voltages, of the sign that they have."""
    assert recording.reference is not None
    whole = recording.reference.sum()
    turn = np.sign(whole.real) * np.exp(-1j * np.angle(whole))
    values, reference = (recording.voltages * turn).real, (recording.reference * turn).real
    return replace(recording, voltages=values, reference=reference)


def noser(rig: Rig) -> tuple[Mesh, FloatArray]:
    """Images (n, n_cells) of the plain method of twenty lines: the floor."""
    prepared = prepare(rig.skin("one-step"))
    model, jacobian = prepared.operator.reference, prepared.problem.jacobian
    values, reference = _scaled(rig, model)
    used = reference != 0
    jacobian = jacobian[used]
    gram = jacobian.T @ jacobian
    power = np.sqrt(np.diag(gram))
    weight = LAMBDA**2 * np.trace(gram) / power.sum() * power
    image = np.linalg.solve(gram + np.diag(weight), jacobian.T @ (values - reference)[:, used].T)
    return prepared.mesh, image.T


def default(rig: Rig, method: str, rule: str | None = None) -> tuple[Mesh, FloatArray, str]:
    """Images (n, n_cells) of the command's own defaults, and what chose alpha."""
    prepared = prepare(rig.skin(method))
    values, reference = _scaled(rig, prepared.operator.reference)
    recording = replace(rig.recording, voltages=values, reference=reference)
    found = reconstruct(prepared, recording, reference[None], rule=rule)
    return prepared.mesh, found.images, found.choice.rule


def _scaled(rig: Rig, model: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Voltages and reference in the model's unit."""
    reference = rig.recording.reference
    values = rig.recording.voltages
    if reference is None:
        reference = values[0]
    scale = np.abs(model).sum() / np.abs(reference).sum()
    usual = np.median(np.abs(model) / np.maximum(np.abs(reference), 1e-12))
    return values * max(scale, usual), reference * max(scale, usual)


def judged(rig: Rig, mesh: Mesh, images: FloatArray) -> dict[str, str]:
    """What of the truth is in the images."""
    if rig.angle is not None:
        return {
            "angle": f"{_angle_error(_middle(mesh, images, rig.sign), rig.angle, rig.sign):.1f}°"
        }
    lost = ghosts = 0
    away: list[float] = []
    for image, objects in zip(images, rig.objects, strict=True):
        if len(objects):
            apart = np.linalg.norm(mesh.centroids[_peaks(mesh, image)][:, None] - objects, axis=2)
            near = apart.min(axis=0, initial=np.inf)
            lost += int((near > NEAR).sum())
            away += near[near <= NEAR].tolist()
            ghosts += int((apart.min(axis=1) > NEAR).sum())
    return {"lost": str(lost), "ghosts": str(ghosts), "error": f"{np.median(away):.3f} R"}


def _peaks(mesh: Mesh, image: FloatArray) -> NDArray[Any]:
    """Cells that no cell at one of their corners exceeds."""
    size = np.abs(image)
    around = _around(mesh)
    most = np.maximum.reduceat(size[around.indices], around.indptr[:-1])
    return np.flatnonzero((size >= most) & (size >= SHOWN * size.max()))


@cache
def _around(mesh: Mesh) -> csr_array:
    n, corners = mesh.cells.shape
    at = (np.repeat(np.arange(n), corners), mesh.cells.ravel())
    table = csr_array((np.ones(n * corners), at), shape=(n, len(mesh.points)))
    return csr_array(table @ table.T)


def _middle(mesh: Mesh, images: FloatArray, sign: int) -> FloatArray:
    """(n, 2) middle of what is above half of the greatest change."""
    greatest = np.take_along_axis(images, np.abs(images).argmax(axis=1)[:, None], axis=1)
    upright = images * (sign or np.sign(greatest))
    weight = np.where(upright > 0.5 * upright.max(axis=1)[:, None], upright, 0.0) * mesh.volumes
    return np.asarray(weight @ mesh.centroids / weight.sum(axis=1)[:, None])


def _angle_error(at: FloatArray, angle: FloatArray, known: int) -> float:
    """Median, degrees: after the best rotation and mirror, as neither is known of the table."""
    seen = np.arctan2(at[:, 1], at[:, 0])
    starts = np.deg2rad(np.arange(0.0, 360.0, 0.5))
    if not known:  # carried round by hand: even, but for its start and end
        paths = [np.unwrap(way * seen) for way in (1, -1)]
        lines = [np.polyval(np.polyfit(angle, path, 1), angle) for path in paths]
        pairs = zip(paths, lines, strict=True)
        return float(np.rad2deg(min(np.median(np.abs(path - line)) for path, line in pairs)))
    away = [np.angle(np.exp(1j * (way * seen - angle - starts[:, None]))) for way in (1, -1)]
    return float(np.rad2deg(min(np.median(np.abs(one), axis=1).min() for one in away)))


def run(data: Path | None) -> Iterator[Report]:
    """The defaults on every rig beside the plain method; ``data`` is the folder of recordings."""
    yield table(
        "tanks of others",
        _figures(data),
        f"found: within {NEAR} R; ghost: a maximum above {SHOWN} of the greatest, farther away",
        f"NOSER: plain differences, λ {LAMBDA}, exponent 1/2; angle: median error",
        across="method",
    )


def _figures(data: Path | None) -> Iterator[dict[str, Any]]:
    for rig in rigs(data):
        use = "chosen by" if rig.chosen else "left out"
        results = {"plain NOSER": noser(rig)}
        for method in ("one-step", "greit"):
            mesh, images, rule = default(rig, method)
            results[f"{method} ({rule})"] = mesh, images
        for method, (mesh, images) in results.items():
            yield {"rig": rig.name, "": use, "method": method, **judged(rig, mesh, images)}
