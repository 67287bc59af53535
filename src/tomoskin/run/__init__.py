"""The running loop: a thread that owns the source, commands to it and messages from it."""

from tomoskin.run import commands
from tomoskin.run.board_check import CheckFinding, check_board
from tomoskin.run.board_memory import BoardMemory
from tomoskin.run.commands import MAX_FORCE, SetPose, SetPresses, SetTwin, StrictRequest
from tomoskin.run.flow import Snapshot
from tomoskin.run.labelled_frames import (
    Workers,
    in_processes,
    in_this_process,
    make_set,
    on_cluster,
    processors,
)
from tomoskin.run.live_skin import LiveSkin, open_skin, prepared_for
from tomoskin.run.recordings import FILE_NAME
from tomoskin.run.robot_run import Member, RobotRun, open_robot, with_joints
from tomoskin.run.runner import Runner
from tomoskin.run.scripted import simulate
from tomoskin.run.status import ReplayStatus, Status
from tomoskin.run.twin_control import way_to_bend

__all__ = [
    "FILE_NAME",
    "MAX_FORCE",
    "BoardMemory",
    "CheckFinding",
    "LiveSkin",
    "Member",
    "ReplayStatus",
    "RobotRun",
    "Runner",
    "SetPose",
    "SetPresses",
    "SetTwin",
    "Snapshot",
    "Status",
    "StrictRequest",
    "Workers",
    "check_board",
    "commands",
    "in_processes",
    "in_this_process",
    "make_set",
    "on_cluster",
    "open_robot",
    "open_skin",
    "prepared_for",
    "processors",
    "simulate",
    "way_to_bend",
    "with_joints",
]
