"""Any robot of LeRobot, and the skin that it wears: touch is part of each observation.

LeRobot finds this package by its name. It records with ``--robot.type=tomoskin``,
``--robot.source=serial:PORT``, and for the robot itself ``--robot.wearer="{type: …, port: …}"``.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import draccus
from lerobot.robots import Robot, RobotConfig, make_robot_from_config

from tomoskin import Skin
from tomoskin.board.source import open_source
from tomoskin.extras.lerobot import FIELDS, SLOTS, PolicyForms
from tomoskin.files.messages import row_labels
from tomoskin.pipeline import prepare
from tomoskin.run import Runner
from tomoskin.run.sinks import Contacts, Item, Sink

PATIENCE = 60.0
"""Seconds in which the untouched skin must have been measured."""


@RobotConfig.register_subclass("tomoskin")
@dataclass
class TomoskinConfig(RobotConfig):
    """The skin, where its frames come from, and the robot that wears it: its type and options.

    ``window``: how many frames an observation holds. The voltages of the frames between two
    observations, and one more, are all of them; with 0 there are touches only.
    """

    skin: str = "textile-disc-8"
    source: str = "twin"
    window: int = 0
    wearer: dict[str, Any] = field(default_factory=dict)


class _Feed(Sink):
    """Every frame of a run, for the forms."""

    name = "lerobot"

    def __init__(self, forms: PolicyForms) -> None:
        self._forms = forms

    def publish(self, item: Item) -> None:
        """Take a frame's contacts; events are nothing here."""
        if isinstance(item, Contacts):
            self._forms.push(item)


def _robot(options: dict[str, Any]) -> Robot:
    """The robot itself; its configuration cannot be a part of one of the same kind."""
    kind = RobotConfig.get_choice_class(options["type"])
    own = {name: value for name, value in options.items() if name != "type"}
    return make_robot_from_config(draccus.decode(kind, own))


class Tomoskin(Robot):
    """The wearer, with touch in its observations."""

    config_class = TomoskinConfig
    name = "tomoskin"

    def __init__(self, config: TomoskinConfig) -> None:
        super().__init__(config)
        self.wearer = _robot(config.wearer) if config.wearer else None
        self.cameras = getattr(self.wearer, "cameras", {})
        self._prepared = prepared = prepare(Skin.load(config.skin))
        self._count, self._labels = config.window, row_labels(prepared.pattern)
        self._forms = PolicyForms(prepared, count=max(config.window, 1))
        self._runner = Runner(
            prepared,
            lambda: open_source(config.source, prepared.skin),
            sinks=[_Feed(self._forms)],
        )
        self._runs = False

    @property
    def observation_features(self) -> dict[str, Any]:
        """Those of the wearer, then a number for each value of touch."""
        own = {} if self.wearer is None else self.wearer.observation_features
        return {**own, **dict.fromkeys(self._names(), float)}

    @property
    def action_features(self) -> dict[str, Any]:
        """Those of the wearer."""
        return {} if self.wearer is None else self.wearer.action_features

    @property
    def is_connected(self) -> bool:
        """Whether skin and wearer run."""
        return self._runs and (self.wearer is None or self.wearer.is_connected)

    @property
    def is_calibrated(self) -> bool:
        """Whether the wearer is: a skin needs none for touches."""
        return self.wearer is None or self.wearer.is_calibrated

    def connect(self, calibrate: bool = True) -> None:
        """Start both; returns when the untouched skin has been measured."""
        if self.wearer is not None:
            self.wearer.connect(calibrate)
        self._prepared.warm_up()  # the first start of a skin makes a table, which takes a while
        self._runner.start()
        self._runs, until = True, time.monotonic() + PATIENCE
        while self._forms.at() is None:
            if time.monotonic() > until:
                self.disconnect()
                raise ConnectionError(f"no frames of the skin came in {PATIENCE:g} s")
            time.sleep(0.02)

    def calibrate(self) -> None:
        """Calibrate the wearer."""
        if self.wearer is not None:
            self.wearer.calibrate()

    def configure(self) -> None:
        """Configure the wearer."""
        if self.wearer is not None:
            self.wearer.configure()

    def get_observation(self) -> dict[str, Any]:
        """What the wearer observes, and the newest touch."""
        own = {} if self.wearer is None else self.wearer.get_observation()
        view = self._forms.at()
        assert view is not None
        values = [float(view.valid), *view.slots.ravel().tolist()]
        if self._count:
            values += [*view.window.ravel().tolist(), *view.ages.tolist()]
        return {**own, **dict(zip(self._names(), values, strict=True))}

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Let the wearer act."""
        return action if self.wearer is None else self.wearer.send_action(action)

    def disconnect(self) -> None:
        """Stop both."""
        self._runs = False
        self._runner.stop()
        if self.wearer is not None:
            self.wearer.disconnect()

    def _names(self) -> list[str]:
        """Names of the values, in their order."""
        frames = range(1 - self._count, 1)
        return [
            "tactile.valid",
            *(f"tactile.touch_{n}.{field}" for n in range(SLOTS) for field in FIELDS),
            *(f"tactile.frame_{n}.{label}" for n in frames for label in self._labels),
            *(f"tactile.age_{n}" for n in frames if self._count),
        ]
