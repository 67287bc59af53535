"""Figure 5.8: maps of an 18 mm probe between E3 and E4, between E7 and E8, and at the centre.

One step with NOSER's prior on normalised differences, threshold 70 %, centre and contour drawn.
The thesis names no force: 5 N here. The probe's middle is 62 mm from the centre of the disc.

Shown: above the pictures, below what exceeds 70 % of the extreme; the probe is dashed, the cross is
the centre that was found. The ring is the touch that tomoskin fits by default to the last of the 40
frames alone; the pictures are of their mean.
Thesis saw: each press localised; its shape poorer near the rim.
Checked: one region each, its centre within 10 mm of the probe's; near the rim the region is longer
than wide by at least 1.2 times, at the centre by less. The fit tells one touch, within 10 mm too.
The thesis's four metrics are reported.
Assumed: the force, 5 N, and the place at the rim, neither of which the thesis gives; a gauge factor
of 10. With 2.4, which is published for a knit, each press is still found, but the change is a fifth
as large, and at the centre the noise shifts it: by 2 to 9 mm with seeds 1 to 6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

import figures
from imaging import NOSER, Imager, named_metrics
from lab import PUBLISHED, Lab, open_lab, report
from tomoskin.core import Detection, FloatArray, Image
from tomoskin.model.mesh import Mesh
from tomoskin.twin import Circle, Probe

RADIUS, FORCE, FROM_CENTRE, PART = 18e-3, 5.0, 62e-3, 0.7
LONGER = 1.2
PLACES = ("between E3 and E4", "between E7 and E8", "at the centre")


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, check, draw; the numbers that were checked."""
    found: dict[str, float] = {}
    with open_lab("fig58_single_press", arguments, __doc__, NOSER) as lab:
        imager = Imager(lab.skin)
        shown = []
        for name, place, stages in pressed(lab):
            image = imager.picture(*stages)
            regions = imager.regions(image, PART)
            found |= check(name, imager.mesh, regions, place)
            found |= named_metrics(name, imager.metrics(image, place))
            touch = imager.touches(*stages)
            found[f"{name}: miss of the fit, mm"] = missed(f"{name}, fit", touch, place)
            shown.append((name, image, regions[0], touch[0], place))
        draw(lab, imager.mesh, shown)
        if lab.seed is not None:
            with lab.otherwise(material=PUBLISHED) as other:
                for name, place, stages in pressed(other):
                    image = imager.picture(*stages)
                    miss = min(distance(r, place) for r in imager.regions(image, PART))
                    found[f"gauge factor 2.4: {name}: miss, mm"] = 1e3 * miss
                    found[f"gauge factor 2.4: {name}: maximum, S"] = float(image.values.min())
    return found


def pressed(
    lab: Lab,
) -> Iterator[tuple[str, tuple[float, float], tuple[FloatArray, FloatArray]]]:
    """Name and place of each press, and the frames before and during it."""
    for name, (x, y) in zip(PLACES, places(lab), strict=True):
        idle = lab.measure(f"nothing touches the skin (before {name})")
        yield (
            name,
            (x, y),
            (idle, lab.measure(f"18 mm probe, 5 N, {name}", Probe(Circle(RADIUS), x, y, FORCE))),
        )


def places(lab: Lab) -> list[tuple[float, float]]:
    """Where the probe stands, m."""
    centres, middle = lab.skin.electrode_centres, lab.skin.outline.centre
    found = []
    for first in (2, 6):
        way = centres[first] + centres[first + 1] - 2 * middle
        found.append(tuple(middle + FROM_CENTRE * way / np.linalg.norm(way)))
    return [*found, tuple(middle)]


def check(
    name: str, mesh: Mesh, regions: Sequence[Detection], place: tuple[float, float]
) -> dict[str, float]:
    """Regions found where the probe stood at ``place`` m."""
    miss = missed(name, regions, place)
    long = elongation(mesh, regions[0])
    at_the_rim = name != PLACES[-1]
    assert (long > LONGER) == at_the_rim, f"{name}: {long:.2f} times as long as wide"
    return {f"{name}: miss, mm": miss, f"{name}: length/width": long}


def missed(name: str, found: Sequence[Detection], place: tuple[float, float]) -> float:
    """How far the only touch is from ``place``, mm."""
    assert len(found) == 1, f"{name}: {len(found)} touches"
    miss = 1e3 * distance(found[0], place)
    assert miss < 10, f"{name}: {miss:.1f} mm off"
    return miss


def distance(touch: Detection, place: tuple[float, float]) -> float:
    """m."""
    return float(np.hypot(touch.x - place[0], touch.y - place[1]))


def elongation(mesh: Mesh, region: Detection) -> float:
    """Length over width of a region: the root of the ratio of its second moments."""
    weight = mesh.volumes[region.cells]
    offset = mesh.centroids[region.cells] - np.average(
        mesh.centroids[region.cells], axis=0, weights=weight
    )
    small, large = np.linalg.eigvalsh((offset.T * weight) @ offset)
    return float(np.sqrt(large / small))


def draw(
    lab: Lab,
    mesh: Mesh,
    shown: Sequence[tuple[str, Image, Detection, Detection, tuple[float, float]]],
) -> None:
    """Maps above, maps with contour and centres below, one colour scale."""
    made, axes = figures.figure(2, len(shown), (7.6, 5.2), sharex=True, sharey=True)
    limit = figures.MS * max(float(np.abs(image.values).max()) for _, image, *_ in shown)
    for column, (name, image, region, fitted, place) in enumerate(shown):
        kept = np.zeros_like(image.values)
        kept[region.cells] = image.values[region.cells]
        for ax, values in zip(axes[:, column], (image.values, kept), strict=True):
            drawn = figures.draw_map(ax, mesh, figures.MS * values, limit)
            figures.mark_probe(ax, figures.circle(*place, RADIUS))
        axes[0, column].set_title(name)
        axes[1, column].set_title("above 70 %")
        figures.mark_region(axes[1, column], mesh, region)
        axes[1, column].plot(figures.MM * fitted.x, figures.MM * fitted.y, "wo", ms=5, mec="k")
    for ax in axes[:, 0]:
        ax.set_ylabel("y / mm")
    figures.letters(axes.ravel())
    figures.colour_bar(made, drawn, axes)
    lab.figure.save(made)


if __name__ == "__main__":
    report(main())
