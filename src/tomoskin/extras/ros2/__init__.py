"""ROS 2 without ROS: a sink, bags of sessions, and joint states live or from a bag."""

from tomoskin.extras.ros2.joint_states import (
    JointStates as JointStates,
    joint_states as joint_states,
)
