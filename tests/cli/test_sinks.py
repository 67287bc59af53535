"""``--sink`` of the commands that run a pipeline."""

from __future__ import annotations

from run.sinks.test_mqtt import broker, heard, mosquitto

__all__ = ["broker", "heard", "mosquitto"]


def test_a_run_is_published_while_it_is_recorded(tomoskin, tmp_path, broker, heard):
    code, _, err = tomoskin(
        "record", tmp_path / "run.mcap", "--frames", 60, "--sink", broker.url
    )  # fmt: skip
    assert code == 0, err
    topic, text = heard()
    assert (topic, text) == ("robot/skin/status", "online")
    while topic != "robot/skin/events":
        topic, text = heard()
    assert '"kind":"' in text


def test_a_sink_that_cannot_be_meant_leaves_no_file(tomoskin, tmp_path):
    code, _, err = tomoskin("record", tmp_path / "run.mcap", "--sink", "kafka:x")
    assert code == 1
    assert "expected a sink among" in err
    assert not (tmp_path / "run.mcap").exists()
    code, _, err = tomoskin("live", "--sink", "foxglove:port")
    assert (code, "expected a port" in err) == (1, True)
