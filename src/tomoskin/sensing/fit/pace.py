"""How much is tried in one frame: all there is to try, or what leaves time for the next one."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pace:
    """Steps are those of Levenberg–Marquardt, by the table.

    Attributes
    ----------
    warm
        Steps from the touches of the frame before.
    glance, cold
        Steps from each of the positions where a new touch may begin, and then from the best one.
    finalists
        Of these positions, the best ones that are gone on with.
    rounds, closing
        Solves of the exact model, each with a few more steps: for each set of touches that is
        tried, and for what is found in the end.
    near
        Part of radius and content by which a touch may differ before the exact model is solved
        for it again.
    tolerance
        Part of the noise, measurement by measurement in the mean square, that what stands for the
        exact model may differ from it by; 0: nothing stands for it.
    tries
        New touches that are tried in a frame.
    look
        Part of the likelihood ratio at which a touch begins from which a further one is tried.
    rare
        Logarithm of the odds against a touch's beginning in a frame: evidence that it needs.
    joint
        Sets of as many new touches as there may be in all that are tried beside, for each number.
    restart
        Whether a frame that does not go on as it was is looked at without what was there too.
    speed
        Of touches along each axis, standard deviation, m/s; 0 where they are taken to stand still.
    fading
        Seconds for which residual responses of touches count as noise; 0 where frames do
        not follow each other.
    """

    warm: int
    glance: int
    cold: int
    finalists: int
    rounds: int
    closing: int
    near: float
    tolerance: float
    tries: int
    look: float
    rare: float
    joint: int
    restart: bool
    speed: float
    fading: float


EXHAUSTIVE = Pace(
    warm=6,
    glance=5,
    cold=15,
    finalists=3,
    rounds=4,
    closing=0,
    near=0.0,
    tolerance=0.0,
    tries=5,
    look=0.5,
    rare=0.0,
    joint=10,
    restart=True,
    speed=0.0,
    fading=0.0,
)
"""Each frame as if it were the only one, of touches that stand still."""

LIVE = Pace(
    warm=4,
    glance=1,
    cold=4,
    finalists=1,
    rounds=0,
    closing=1,
    near=0.5,
    tolerance=0.1,
    tries=3,
    look=0.6,
    rare=math.log(200),
    joint=0,
    restart=False,
    speed=0.1,
    fading=8.0,
)
"""What is not found in this frame is found in the next. With one try, presses that begin together
are one touch between them for some frames."""
