"""What a replay plays of a damaged file."""

from __future__ import annotations

from files.session.runs import write_frames
from files.session.test_damage import chunk_ends
from tomoskin.files.session import SessionReader
from tomoskin.files.session.playback import Playhead


def test_it_plays_what_is_before_the_damage_and_says_what_is_wrong(tmp_path):
    path = write_frames(tmp_path / "damaged.mcap", 200)
    data = bytearray(path.read_bytes())
    (_, whole), (end, _) = chunk_ends(bytes(data))[:2]
    data[end - 20] ^= 0x10
    path.write_bytes(data)
    with SessionReader(path) as session:
        head, played = Playhead(session.reads), 0
        while head.next is not None:
            played += len(head.play().frames)
        assert played == whole
        assert "the CRC of a chunk is wrong" in str(head.damage)
        head.seek(float("-inf"))
        assert head.next is not None
        assert head.damage is None
