"""Figure 5.11: the flat skin's reference, then the skin on cylinders of 40 and 70 mm.

One step with NOSER's prior on normalised differences against the flat skin, which is read again
before each cylinder; threshold 70 %, the twin of ``textile-disc-8``. The thesis calls 40 and 70 mm
diameters and radii by turns: radii here. Its foam kept the skin from lying close to the smaller
cylinder, and strips held its sides: here it follows 50° of the 40 mm and 70° of the 70 mm and hangs
straight beyond.

Shown: changes against the flat skin on one scale, and a press on the flat skin beside them.
Thesis saw: an elongated region along the cylinder instead of an ellipse; its area and its maximum
grow with the diameter, the maximum slightly.
Checked: the largest region lies along the axis, at least 1.7 times as long as wide, that of a press
at most 1.5; area and maximum grow with the radius.
Assumed: both angles, so that the maximum grows. Wrapped by the same 60°, the area grows, but the
maximum falls, for strain is the foam's height over the radius; with 70° and 50° it falls more. So
the growth of the maximum is not explained by the model. Wrapped all around 70 mm the whole sheet
changes evenly, and no region along the cylinder stands out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import figures
from fig58_single_press import elongation
from imaging import NOSER, Imager
from lab import Lab, open_lab, report
from tomoskin.core import Detection, Image
from tomoskin.model.mesh import Hinge
from tomoskin.twin import Bent, Circle, Pose, Probe

PART, LONGER, ROUND = 0.7, 1.7, 1.5
PRESS = Probe(Circle(18e-3), 30e-3, 20e-3, 5.0)
Shown = tuple[str, Image, Detection]


def over(radius: float, degrees: float) -> Pose:
    """On a cylinder of ``radius`` m along y, close to it over so much of its circumference."""
    angle = math.radians(degrees)
    return (Bent(Hinge(angle, angle * radius)),)


STAGES: dict[str, tuple[Pose, tuple[Probe, ...]]] = {
    "40 mm cylinder": (over(0.04, 50), ()),
    "70 mm cylinder": (over(0.07, 70), ()),
    "18 mm probe, flat": ((), (PRESS,)),
}
OTHERS = {"by the same 60°": (60, 60), "by 70° and 50°": (70, 50)}
"""Degrees of either cylinder that the skin might follow instead."""


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, check, draw; the numbers that were checked."""
    with open_lab("fig511_cylinders", arguments, __doc__, NOSER) as lab:
        imager = Imager(lab.skin)
        shown = [wrapped(lab, imager, name, *stage) for name, stage in STAGES.items()]
        found = check(imager, shown)
        draw(lab, imager, shown)
        if lab.seed is not None:
            found |= without(lab, imager)
    return found


def wrapped(lab: Lab, imager: Imager, name: str, pose: Pose, probes: Sequence[Probe] = ()) -> Shown:
    """Picture and largest region of a stage against the flat skin just before it."""
    lab.bend(())
    idle = lab.measure(f"flat, nothing touches the skin (before {name})", n=20)
    lab.bend(pose)
    image = imager.picture(idle, lab.measure(name, *probes, n=20))
    regions = imager.regions(image, PART)
    assert regions, f"{name}: nothing found"
    return name, image, max(regions, key=lambda region: region.area)


def without(lab: Lab, imager: Imager) -> dict[str, float]:
    """How area and maximum grow with the radius for other angles, and with the larger one first."""
    found = {}
    cases = {name: (0.04, small, 0.07, large) for name, (small, large) in OTHERS.items()}
    for name, (first, angle, second, other_angle) in (
        *cases.items(),
        ("70 mm first", (0.07, 70, 0.04, 50)),
    ):
        with lab.otherwise() as other:
            pair = [
                wrapped(other, imager, f"{1e3 * radius:g} mm", over(radius, degrees))
                for radius, degrees in ((first, angle), (second, other_angle))
            ]
        small, large = pair if first < second else pair[::-1]
        found[f"{name}, 70 over 40 mm: area"] = large[2].area / small[2].area
        most = [float(image.values.min()) for _, image, _ in (small, large)]
        found[f"{name}, 70 over 40 mm: maximum"] = most[1] / most[0]
    return found


def check(imager: Imager, shown: Sequence[Shown]) -> dict[str, float]:
    """What the thesis saw, and what the model says of its cause."""
    assert min(len(region.cells) for _, _, region in shown) > 2, "a region without length and width"
    long = [elongation(imager.mesh, region) for _, _, region in shown]
    turn = [axis_of(imager, region) for _, _, region in shown[:2]]
    assert min(long[:2]) > LONGER, f"{long[0]:.2f} and {long[1]:.2f} times as long as wide"
    assert max(abs(turn[0]), abs(turn[1])) < 30, f"{turn[0]:.0f}° and {turn[1]:.0f}° off the axis"
    assert long[2] < ROUND, f"a press {long[2]:.2f} times as long as wide"
    miss = math.hypot(shown[2][2].x - PRESS.x, shown[2][2].y - PRESS.y)
    assert miss < 0.015, f"the press is {1e3 * miss:.0f} mm off"
    areas = [1e6 * region.area for _, _, region in shown]
    most = [-1e3 * float(image.values.min()) for _, image, _ in shown]
    assert areas[1] > areas[0], f"areas of {areas[0]:.0f} and {areas[1]:.0f} mm²"
    assert most[1] > most[0], f"maxima of {most[0]:.0f} and {most[1]:.0f} mS"
    return {
        "40 mm: length/width": long[0],
        "70 mm: length/width": long[1],
        "press: length/width": long[2],
        "40 mm: area, mm²": areas[0],
        "70 mm: area, mm²": areas[1],
        "40 mm: maximum, mS": most[0],
        "70 mm: maximum, mS": most[1],
    }


def axis_of(imager: Imager, region: Detection) -> float:
    """Degrees between the length of a region and the cylinder's axis, y."""
    place, weight = imager.mesh.centroids[region.cells], imager.mesh.volumes[region.cells]
    offset = place - np.average(place, axis=0, weights=weight)
    x, y = np.linalg.eigh((offset.T * weight) @ offset)[1][:, 1]
    return math.degrees(math.atan(x / y))


def draw(lab: Lab, imager: Imager, shown: Sequence[Shown]) -> None:
    """One colour scale; the regions' contours."""
    made, axes = figures.figure(1, 3, (7.6, 2.9), sharex=True, sharey=True)
    limit = figures.MS * max(float(np.abs(image.values).max()) for _, image, _ in shown)
    for ax, (name, image, region) in zip(axes[0], shown, strict=True):
        drawn = figures.draw_map(ax, imager.mesh, figures.MS * image.values, limit)
        figures.mark_region(ax, imager.mesh, region)
        ax.set_title(name)
    axes[0, 0].set_ylabel("y / mm")
    figures.letters(axes[0])
    figures.colour_bar(made, drawn, axes)
    lab.figure.save(made)


if __name__ == "__main__":
    report(main())
