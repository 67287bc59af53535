"""Figure 5.12: an 18 mm probe on a 70 mm cylinder, a chair's back, and an arm whose joint moves.

References are taken after the skin is attached, as in the thesis. The cylinder has a radius of
70 mm; the chair's back is a saddle of 400 and 600 mm (assumed); the arm's 30 mm are taken for its
radius, and its joint bends over 60 mm, 5 N: assumed. One step with NOSER's prior on normalised
differences, threshold 70 %, the twin of ``textile-disc-8``.

Shown: the same press on three bodies, and on the arm with its joint at 37° by three references; in
the last the joint hides the press.
Thesis saw: the touch found on all of them; moving the joint needs a new reference, by its encoder.
Checked: one touch within 15 mm of the probe on each body. The arm's joint at 37° uses a reference
interpolated between 0, 15, 30 and 45° of the encoder. Its touch is at most 1.2 times as far off as
with a reference taken there, or 3 mm more. Against the straight arm's reference the moved joint
alone changes the picture by more than half of what a touch does; with the encoder by less than 0.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import figures
from imaging import NOSER, Imager
from lab import Lab, open_lab, report
from tomoskin.core import Detection, FloatArray, Image
from tomoskin.learning import JointReference
from tomoskin.model.mesh import Cylinder, Hinge, Saddle
from tomoskin.twin import Bent, Circle, Pose, Probe

RADIUS, FORCE, PART = 18e-3, 5.0, 0.7
PLACE = (25e-3, 20e-3)
JOINT, AT, ENCODER = 0.06, 37.0, (0.0, 15.0, 30.0, 45.0)
Shown = tuple[str, Image, list[Detection]]


def arm(degrees: float) -> Pose:
    """The skin lies along the arm, over its joint."""
    return (Bent(Hinge(math.radians(degrees), JOINT, axis=0.0)),)


BODIES: dict[str, Pose] = {
    "70 mm cylinder": (Bent(Cylinder(0.07)),),
    "chair's back": (Bent(Saddle(0.4, 0.6)),),
    "arm, straight": arm(0.0),
}


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Measure, check, draw; the numbers that were checked."""
    with open_lab("fig512_curved", arguments, __doc__, NOSER) as lab:
        imager = Imager(lab.skin)
        shown = [on_body(lab, imager, name, pose) for name, pose in BODIES.items()]
        found = {f"{name}: miss, mm": checked(name, regions) for name, _, regions in shown}
        moved, alone = at_the_joint(lab, imager)
        found |= check_joint(moved, alone)
        draw(lab, imager, [*shown, *moved])
    return found


def on_body(lab: Lab, imager: Imager, name: str, pose: Pose) -> Shown:
    """The picture of a press against the skin as it lies on the body."""
    lab.bend(pose)
    idle = lab.measure(f"on the {name}, nothing touches it", n=20)
    loaded = lab.measure(f"on the {name}, 18 mm probe, 5 N", probe(), n=20)
    image = imager.picture(idle, loaded)
    return name, image, imager.regions(image, PART)


def at_the_joint(lab: Lab, imager: Imager) -> tuple[list[Shown], list[float]]:
    """The joint at 37°: by a reference there, by the encoder's, by that of the straight arm.

    And S, the largest change of the picture without a touch by the latter two.
    """
    rows, angles = [], []
    for degrees in ENCODER:
        lab.bend(arm(degrees))
        rows.append(lab.measure(f"joint at {degrees:.0f}°, nothing touches the skin", n=20))
        angles += [math.radians(degrees)] * 20
    joint = JointReference.of(np.concatenate(rows), angles)
    lab.bend(arm(AT))
    there = lab.measure(f"joint at {AT:.0f}°, nothing touches the skin", n=20)
    loaded = lab.measure(f"joint at {AT:.0f}°, 18 mm probe, 5 N", probe(), n=20)
    references = {
        "joint 37°, own reference": there,
        "joint 37°, by its encoder": joint.at(math.radians(AT)).mean[None],
        "joint 37°, reference at 0°": rows[0],
    }
    pictures = {name: imager.picture(idle, loaded) for name, idle in references.items()}
    alone = [
        float(np.abs(imager.picture(idle, there).values).max())
        for idle in list(references.values())[1:]
    ]
    shown = [(name, image, imager.regions(image, PART)) for name, image in pictures.items()]
    return shown, alone


def probe() -> Probe:
    """The thesis's."""
    return Probe(Circle(RADIUS), *PLACE, FORCE)


def checked(name: str, regions: Sequence[Detection]) -> float:
    """By how many mm the one region that there must be misses the probe."""
    assert len(regions) == 1, f"{name}: {len(regions)} regions"
    miss = missed(regions[0])
    assert miss < 15, f"{name}: {miss:.1f} mm off"
    return miss


def check_joint(moved: Sequence[Shown], alone: Sequence[float]) -> dict[str, float]:
    """What the encoder is worth."""
    own, encoder = (checked(name, regions) for name, _, regions in moved[:2])
    assert encoder < max(1.2 * own, own + 3), f"{encoder:.1f} mm by the encoder, {own:.1f} there"
    touch = float(np.abs(moved[0][1].values).max())
    followed, left = (change / touch for change in alone)
    assert left > 0.5, f"moving the joint changes {left:.2f} of what a touch does"
    assert followed < 0.3, f"{followed:.2f} of it left by the encoder's reference"
    return {
        "joint moved, own reference: miss, mm": own,
        "joint moved, by its encoder: miss, mm": encoder,
        "joint alone, of a touch, by its encoder": followed,
        "joint alone, of a touch, reference at 0°": left,
    }


def missed(region: Detection) -> float:
    """Mm from the probe."""
    return 1e3 * math.hypot(region.x - PLACE[0], region.y - PLACE[1])


def draw(lab: Lab, imager: Imager, shown: Sequence[Shown]) -> None:
    """Bodies above, the joint below, each row with a colour scale of its own."""
    made, axes = figures.figure(2, 3, (7.6, 5.4), sharex=True, sharey=True)
    rows: list[tuple[FloatArray, Sequence[Shown]]] = [(axes[0], shown[:3]), (axes[1], shown[3:])]
    for row, part in rows:
        limit = figures.MS * max(float(np.abs(image.values).max()) for _, image, _ in part[:2])
        for ax, (name, image, regions) in zip(row, part, strict=True):
            drawn = figures.draw_map(ax, imager.mesh, figures.MS * image.values, limit)
            figures.mark_probe(ax, figures.circle(*PLACE, RADIUS))
            for region in regions:
                figures.mark_region(ax, imager.mesh, region)
            ax.set_title(name)
        figures.colour_bar(made, drawn, row)
        row[0].set_ylabel("y / mm")
    figures.letters(axes.ravel())
    lab.figure.save(made)


if __name__ == "__main__":
    report(main())
