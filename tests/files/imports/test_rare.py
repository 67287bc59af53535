"""What is rare in a long file is found by the index, not by reading the file."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mcap.opcode import Opcode

from files.session.runs import INFO, SKIN, frame_of, put
from tomoskin.core import DataError, Event
from tomoskin.files.session import SessionReader, SessionWriter
from tomoskin.files.session.container_reader import ContainerReader
from tomoskin.files.session.mcap_records import PREFIX, Summary
from tomoskin.files.session.session_reader import tick_rate


@pytest.fixture
def long_file(tmp_path):
    """Two boards, three events and a few thousand frames between them."""
    path = tmp_path / "long.mcap"
    with SessionWriter(path, SKIN) as session:
        session.device(0.0, INFO)
        for number in range(600):
            put(session, frame_of(number))
            if number % 200 == 100:
                session.event(Event(frame_of(number).host_time, "gap", f"frame {number}"))
        session.device(frame_of(600).host_time, replace(INFO, tick_rate=2_000_000))
    return path


@pytest.fixture
def chunks_read(monkeypatch):
    """Offsets of the chunks that were read."""
    read, original = [], ContainerReader._messages_at

    def chunk(self, offset):
        read.append(offset)
        return original(self, offset)

    monkeypatch.setattr(ContainerReader, "_messages_at", chunk)
    return read


def test_only_the_chunks_that_hold_it_are_read(long_file, chunks_read):
    with SessionReader(long_file) as session:
        assert tick_rate(session) == 2e6
        assert len(chunks_read) == 1
        assert [event.text for event in session.events()] == [
            f"frame {number}" for number in (100, 300, 500)
        ]
        assert len(chunks_read) == 4
        assert list(session.notes()) == []
        assert session.settings() == {}
        assert len(chunks_read) == 4


def test_without_an_end_it_is_found_all_the_same(long_file):
    data = long_file.read_bytes()
    long_file.write_bytes(data[: data.rindex(PREFIX.pack(Opcode.DATA_END, 4))])
    with SessionReader(long_file) as session:
        assert tick_rate(session) == 2e6
        assert len(list(session.events())) == 3


@pytest.mark.parametrize("cut", [1, 5])
def test_an_index_that_does_not_add_up_is_damage(long_file, cut):
    with SessionReader(long_file) as session:
        index = session.container.summary
        for wrong in (index.chunk_index[cut:], index.chunk_index[:-cut]):
            session.container.summary = Summary(index.totals, index.attachments, wrong)
            with pytest.raises(DataError, match="index of the chunks"):
                session.device()
