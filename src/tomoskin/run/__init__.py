"""The running loop: a thread that owns the source, commands to it and messages from it."""

from tomoskin.run import commands as commands
from tomoskin.run.board_check import CheckFinding as CheckFinding, check_board as check_board
from tomoskin.run.commands import (
    MAX_FORCE as MAX_FORCE,
    Opener as Opener,
    SetPose as SetPose,
    SetPresses as SetPresses,
    SetTwin as SetTwin,
    StrictRequest as StrictRequest,
)
from tomoskin.run.flow import Snapshot as Snapshot
from tomoskin.run.live_skin import (
    LiveSkin as LiveSkin,
    open_skin as open_skin,
    prepared_for as prepared_for,
)
from tomoskin.run.publisher import Turns as Turns
from tomoskin.run.recordings import FILE_NAME as FILE_NAME
from tomoskin.run.runner import Runner as Runner
from tomoskin.run.scripted import simulate as simulate
from tomoskin.run.status import ReplayStatus as ReplayStatus, Status as Status
from tomoskin.run.twin_control import way_to_bend as way_to_bend
