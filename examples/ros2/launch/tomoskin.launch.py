"""Start a skin beside the nodes of a robot: ``ros2 launch tomoskin_launch tomoskin.launch.py``.

The command ``tomoskin`` must be on the PATH, with the extra ``ros2``. Arguments are those below,
as in ``source:=serial:/dev/ttyACM0 parent:=tool0 at:=0/0/0.05``.
"""

import os

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

ARGUMENTS = {
    "skin": ("textile-disc-8", "built-in name or path of a skin file"),
    "source": ("twin", "serial:PORT for a board"),
    "calibrations": ("", "files from tomoskin calibrate, with spaces between them"),
    "robot": ("", "a robot file, in place of skin, source and calibrations"),
    "namespace": ("tomoskin", "what topics begin with"),
    "parent": ("", "link of the robot that the skin lies on"),
    "at": ("", "pose of the skin there: X/Y/Z or X/Y/Z/ROLL/PITCH/YAW, m and rad"),
    "folder": ("", "where recordings go; without it nodes cannot ask for any"),
    "release": (os.environ.get("ROS_DISTRO", ""), "of ROS 2, whose nodes see the skin's name"),
    "port": ("8765", "of the page"),
}


def command(given):
    """The words of the command for those arguments, texts by name."""
    if given["robot"]:
        words = ["--robot", given["robot"]]
    else:
        words = ["--skin", given["skin"], "--source", given["source"]]
        for file in given["calibrations"].split():
            words += ["--calibration", file]
    options = [f"{k}={given[k]}" for k in ("namespace", "parent", "at", "folder") if given[k]]
    if given["release"] == "humble":
        options.append("release=humble")
    sink = f"ros2:{','.join(options)}"
    return ["tomoskin", "live", *words, "--sink", sink, "--port", given["port"]]


def start(context):
    """The process, once the arguments are known."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    return [ExecuteProcess(cmd=command(given), output="screen")]


def generate_launch_description():
    """What ROS 2's launch asks for."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
