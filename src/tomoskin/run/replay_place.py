"""Where a replay is."""

from __future__ import annotations

import math

from tomoskin.run.status import ReplayStatus
from tomoskin.run.wishes import Replayed


def where_is(replay: Replayed, *, ended: bool) -> ReplayStatus:
    """One look at a replay; ``ended``: its last frame has been processed."""
    speed = None if math.isinf(replay.speed) else replay.speed
    now, end = replay.now() - replay.start, replay.end - replay.start
    return ReplayStatus(now, max(now, end), speed, replay.loop, ended)
