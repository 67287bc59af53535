"""The class that a sheet shows, in Chromium on the twin of a skin that bends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from server.bent import frames_bent
from server.serving import Site
from tomoskin.board.source import open_source
from tomoskin.extras.classes import CLASSES, Classifier
from tomoskin.run import Runner
from tomoskin.run.commands import BendRequest, SetPose
from tomoskin.server.handlers import TwinHandlers

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

WIDTH = 0.08
ANGLES = np.radians([0, 15, 30, 45, 60, 45, 30, 15] * 4 + [0])
TRUE = math.radians(40)


def learnt(prepared):
    """The skin with the classes straight and bent."""
    dv, pattern = frames_bent(prepared, ANGLES, WIDTH, seed=4), prepared.pattern
    labels = ["bent" if angle else "straight" for angle in ANGLES]
    states = Classifier.fit(dv, labels, pattern=pattern, skin_id=prepared.skin.identity)
    return prepared.calibrated(CLASSES.of(states, pattern, prepared.skin))


@pytest.fixture(scope="module")
def site(prepared):
    runner = Runner(
        learnt(prepared), lambda: open_source("twin:preset=ideal,seed=1", prepared.skin)
    )
    runner.start()
    site = Site(runner, take=TwinHandlers)
    yield site
    site.stop()
    runner.stop()


def place(element):
    """Where its upper left corner is, and how high it is."""
    box = element.bounding_box()
    return box["x"], box["y"], box["height"]


def test_the_class_is_said_on_one_line_that_does_not_move(opened):
    said, runner = opened.test_id("class-words"), opened.site.runner
    said.filter(has_text="straight").wait_for()
    straight = place(said)
    runner.ask(SetPose(BendRequest(TRUE, length=WIDTH)))
    said.filter(has_text="bent").wait_for()
    assert place(said) == straight
    assert said.get_attribute("title").startswith("Class")
    runner.ask(SetPose())
    said.filter(has_text="straight").wait_for()
