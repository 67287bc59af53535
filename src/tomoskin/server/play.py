"""What a person does to a replay."""

from __future__ import annotations

import math

from tomoskin.run import Replayed
from tomoskin.server.requests import ReplayRequest, Seek, SetLoop, SetSpeed


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
