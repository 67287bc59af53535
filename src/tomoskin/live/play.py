"""What a person does to a replay, and where it is."""

from __future__ import annotations

import math

from tomoskin.live.requests import ReplayRequest, Seek, SetLoop, SetSpeed
from tomoskin.live.status import ReplayStatus
from tomoskin.live.wishes import Replayed


def where_is(replay: Replayed, *, ended: bool) -> ReplayStatus:
    """One look at a replay; ``ended``: its last frame has been processed."""
    speed = None if math.isinf(replay.speed) else replay.speed
    now, end = replay.now() - replay.start, replay.end - replay.start
    return ReplayStatus(now, max(now, end), speed, replay.loop, ended)


def play(replay: Replayed, request: ReplayRequest) -> None:
    """Do what is asked; a jump reads the file up to there when it is the first."""
    if isinstance(request, Seek):
        replay.seek(replay.start + request.at_s)
    elif isinstance(request, SetSpeed):
        replay.speed = math.inf if request.speed is None else request.speed
    elif isinstance(request, SetLoop):
        replay.loop = request.on
    else:
        replay.step()
