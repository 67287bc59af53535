"""``--sink`` of the commands that run a pipeline."""

from __future__ import annotations


def test_a_sink_that_cannot_be_meant_leaves_no_file(tomoskin, tmp_path):
    code, _, err = tomoskin("record", tmp_path / "run.mcap", "--sink", "kafka:x")
    assert code == 1
    assert "expected a sink among" in err
    assert not (tmp_path / "run.mcap").exists()
    code, _, err = tomoskin("live", "--sink", "kafka:x")
    assert (code, "expected a sink among" in err) == (1, True)
