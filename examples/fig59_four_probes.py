"""Figure 5.9: circles of 15, 18 and 25 mm radius and a square at the centre, one colour scale.

3 N each; one step with NOSER's prior on normalised differences. As in the thesis, the circles are
named by their radius and the square by its side.

Shown: four pictures on one scale, with the greatest change in each title; probes are dashed.
Thesis saw: the maximum shows the size; round and square cannot be distinguished.
Checked: the maximum grows from 15 to 18 to 25 mm, each time by more than 3 standard deviations
of its noise; the picture of the square has the shape of the circles' (correlation over 0.97, and
RES50 within the circles' range ± 5 %). The thesis's four metrics are reported.
Assumed: means of 40 frames (the thesis: 10), and one press before all others that is not counted,
since the knit remembers its first load. The thesis names neither. With 10 frames, or without that
press, the step from 15 to 18 mm is too small for its noise, and the check fails.
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
        images, deviations = pressed(lab, imager)
        for name, image in images.items():
            found |= named_metrics(name, imager.metrics(image, (0.0, 0.0)))
        found |= check(imager, list(images.values()), deviations)
        draw(lab, imager.mesh, images)
        if lab.seed is not None:
            for name, first, frames in (("10 frames", FIRST, 10), ("no press before", (), FRAMES)):
                with lab.otherwise() as other:
                    others, noise = pressed(other, imager, first, frames)
                steps = growth(list(others.values()), noise)
                found |= {f"{name}: growth {k + 1}, deviations": s for k, s in enumerate(steps)}
    return found


def pressed(
    lab: Lab, imager: Imager, first: Sequence[Probe] = FIRST, frames: int = FRAMES
) -> tuple[dict[str, Image], list[float]]:
    """Pictures of the probes by name, and the noise of the greatest value of each, S."""
    images, deviations = {}, []
    if first:
        lab.measure("circle, r 25 mm, 3 N, at the centre, once before all", *first, n=1)
    for name, shape in PROBES.items():
        idle = lab.measure(f"nothing touches the skin (before {name})", n=frames)
        probe = Probe(shape, 0.0, 0.0, FORCE)
        loaded = lab.measure(f"{name}, 3 N, at the centre", probe, n=frames)
        images[name] = imager.picture(idle, loaded)
        deviations.append(noise_of_maximum(imager, images[name], idle))
    return images, deviations


def noise_of_maximum(imager: Imager, image: Image, idle: FloatArray) -> float:
    """Standard deviation of the greatest value, from the noise of two means of frames, S."""
    floor = imager.prepared.image_noise(Reference.of(idle))
    assert floor is not None
    return float(floor.sd[np.abs(image.values).argmax()] * np.sqrt(2 / len(idle)))


def check(imager: Imager, images: Sequence[Image], deviations: Sequence[float]) -> dict[str, float]:
    """Pictures of the three circles, then of the square."""
    circles, square = images[:3], images[3]
    steps = growth(images, deviations)
    assert min(steps) > 3, f"the maximum does not grow with size: by {steps} deviations"
    alike = [float(np.corrcoef(square.values, image.values)[0, 1]) for image in circles]
    assert max(alike) > 0.97, f"the square's picture differs: correlations {alike}"
    res = [imager.metrics(image).res50 for image in images]
    assert 0.95 * min(res[:3]) < res[3] < 1.05 * max(res[:3]), f"RES50 tells the square: {res}"
    grown = {f"growth {k + 1}, deviations": step for k, step in enumerate(steps)}
    return grown | {"square like circle, correlation": max(alike)}


def growth(images: Sequence[Image], deviations: Sequence[float]) -> list[float]:
    """By how many standard deviations the maximum grows from circle to circle."""
    maxima = [float(np.abs(image.values).max()) for image in images[:3]]
    steps = np.diff(maxima) / np.hypot(deviations[:2], deviations[1:3])
    return [float(step) for step in steps]


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
