"""``--sink`` of a command that runs a pipeline, before a real broker."""

from __future__ import annotations

from cli.conftest import tomoskin
from extras.mqtt.test_mqtt import broker, heard, mosquitto

__all__ = ["broker", "heard", "mosquitto", "tomoskin"]


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
