"""Figure 5.9: circles of 15, 18 and 25 mm radius and a square at the centre, one colour scale.

3 N each; one step with NOSER's prior on normalised differences. As in the thesis, the circles are
named by their radius and the square by its side.

Shown: four pictures on one scale, with the greatest change in each title; probes are dashed.
Thesis saw: the maximum shows the size; round and square cannot be distinguished.
Checked: the maximum grows from 15 to 18 to 25 mm, each time by more than 3 standard deviations
of its noise; the picture of the square has the shape of the circles' (correlation over 0.97, and
RES50 within the circles' range ± 5 %). The thesis's four metrics are reported.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import figures
from imaging import FRAMES, NOSER, Imager, named_metrics
from lab import Lab, open_lab, report
from tomoskin.core import FloatArray, Image
from tomoskin.model.mesh import Mesh
from tomoskin.sensing.signal import Reference
from tomoskin.twin import Circle, Probe, Square

FORCE = 3.0
PROBES = {
    "circle, r 15 mm": Circle(15e-3),
    "circle, r 18 mm": Circle(18e-3),
    "circle, r 25 mm": Circle(25e-3),
    "square, 15 mm": Square(15e-3),
}

FIRST = (Probe(PROBES["circle, r 25 mm"], 0.0, 0.0, FORCE),)
"""Pressed once and not counted: textile answers its first loading otherwise than all later ones."""


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, check, draw; the numbers that were checked."""
    found: dict[str, float] = {}
    with open_lab("fig59_four_probes", arguments, __doc__, NOSER) as lab:
        imager = Imager(lab.skin)
        images, deviations = {}, []
        lab.measure("circle, r 25 mm, 3 N, at the centre, once before all", *FIRST, n=1)
        for name, shape in PROBES.items():
            idle = lab.measure(f"nothing touches the skin (before {name})", n=FRAMES)
            probe = Probe(shape, 0.0, 0.0, FORCE)
            loaded = lab.measure(f"{name}, 3 N, at the centre", probe, n=FRAMES)
            images[name] = imager.picture(idle, loaded)
            deviations.append(noise_of_maximum(imager, images[name], idle))
            found |= named_metrics(name, imager.metrics(images[name], (0.0, 0.0)))
        found |= check(imager, list(images.values()), deviations)
        draw(lab, imager.mesh, images)
    return found


def noise_of_maximum(imager: Imager, image: Image, idle: FloatArray) -> float:
    """Standard deviation of the greatest value, from the noise of two means of frames, S."""
    floor = imager.prepared.image_noise(Reference.of(idle))
    assert floor is not None
    return float(floor.sd[np.abs(image.values).argmax()] * np.sqrt(2 / len(idle)))


def check(imager: Imager, images: Sequence[Image], deviations: Sequence[float]) -> dict[str, float]:
    """Pictures of the three circles, then of the square."""
    circles, square = images[:3], images[3]
    maxima = [float(np.abs(image.values).max()) for image in circles]
    steps = np.diff(maxima) / np.hypot(deviations[:2], deviations[1:3])
    assert (steps > 3).all(), f"the maximum does not grow with size: {maxima} S, {steps} deviations"
    alike = [float(np.corrcoef(square.values, image.values)[0, 1]) for image in circles]
    assert max(alike) > 0.97, f"the square's picture differs: correlations {alike}"
    res = [imager.metrics(image).res50 for image in images]
    assert 0.95 * min(res[:3]) < res[3] < 1.05 * max(res[:3]), f"RES50 tells the square: {res}"
    growth = {f"growth {k + 1}, deviations": float(step) for k, step in enumerate(steps)}
    return growth | {"square like circle, correlation": max(alike)}


def draw(lab: Lab, mesh: Mesh, images: dict[str, Image]) -> None:
    """Four maps on one colour scale, the probes dashed."""
    made, axes = figures.figure(1, len(images), (9.4, 2.8), sharey=True)
    limit = figures.MS * max(float(np.abs(image.values).max()) for image in images.values())
    for ax, (name, image) in zip(axes[0], images.items(), strict=True):
        drawn = figures.draw_map(ax, mesh, figures.MS * image.values, limit)
        shape = PROBES[name]
        if isinstance(shape, Circle):
            figures.mark_probe(ax, figures.circle(0.0, 0.0, shape.radius))
        else:
            figures.mark_probe(ax, figures.square(0.0, 0.0, shape.side))
        ax.set_title(f"{name}: {figures.MS * np.abs(image.values).max():.0f} mS")
    axes[0, 0].set_ylabel("y / mm")
    figures.letters(axes.ravel())
    figures.colour_bar(made, drawn, axes)
    lab.figure.save(made)


if __name__ == "__main__":
    report(main())
