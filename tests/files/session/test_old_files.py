"""A session as 0.1 wrote it, in chunks of 8 KiB and with an index of its own, is read as it was."""

from __future__ import annotations

from pathlib import Path

import pytest

from files.session.runs import INFO, frame_of, same_frame
from tomoskin.files.imports import read_recording
from tomoskin.files.session import SessionReader, message_counts, repair, session_info

OLD = Path(__file__).parent / "of_0_1.mcap"


def test_everything_in_it_is_read():
    with SessionReader(OLD) as session:
        found = [item.frame for item in session.frames()]
        assert all(same_frame(frame, frame_of(n)) for n, frame in enumerate(found))
        assert len(found) == 40
        assert session.device()["unique_id"] == INFO.unique_id.hex()
        assert session.settings()["source"] == "twin"
        assert [note.text for note in session.notes()] == ["last"]
        assert [item.sequence for item in session.touches()] == [39]
        assert not session.torn
    assert len(read_recording(OLD)) == 40


@pytest.mark.parametrize("number", [1, 17, 39])
def test_a_moment_in_it_is_found(number):
    with SessionReader(OLD) as session:
        first = next(session.frames(frame_of(number).host_time))
    assert first.frame.sequence == number


@pytest.mark.parametrize("size", [None, -300])
def test_it_is_repaired_without_the_offsets_of_the_old_file(tmp_path, size):
    cut, mended = tmp_path / "cut.mcap", tmp_path / "mended.mcap"
    cut.write_bytes(OLD.read_bytes()[:size])
    assert repair(cut, mended).lost == []
    with SessionReader(mended) as new, SessionReader(OLD) as old:
        assert message_counts(new) == message_counts(old)
        assert set(new.attachments()) == {"skin.toml"}
    assert session_info(mended).attached == session_info(OLD).attached == ()
