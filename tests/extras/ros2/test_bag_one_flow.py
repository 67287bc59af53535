"""A bag has the touches of its session, whatever that recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from cli.conftest import tomoskin
from cli.test_one_flow import fitted, session
from tomoskin.files.session import SessionReader, reconstruct_session
from tomoskin.pipeline import Prepared

__all__ = ["fitted", "session", "tomoskin"]


def test_a_bag_says_what_a_replay_finds(
    session: Path, fitted: Prepared, tmp_path: Path, tomoskin
) -> None:
    bag = tmp_path / "bag.mcap"
    code, _, err = tomoskin("session", "export", session, bag, "--every", "1e9")
    assert code == 0, err
    with SessionReader(session) as reader:
        found = reconstruct_session(fitted, reader).touches
    spots = [touch.detection for touches in found for touch in touches]
    assert bag_positions(bag) == [(spot.x, spot.y) for spot in spots]


def bag_positions(path: Path) -> list[tuple[float, float]]:
    """Positions of all touches, in their order."""
    with AnyReader([path], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        chosen = [c for c in reader.connections if c.topic == "/tomoskin/track"]
        read = reader.messages(chosen)
        tracks: list[Any] = [reader.deserialize(d, c.msgtype) for c, _, d in read]
    poses = [track.pose.pose for track in tracks]
    return [(pose.position.x, pose.position.y) for pose in poses]
