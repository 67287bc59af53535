"""A body whose state is no angle, on the page in Chromium: a finger that curls by its pressure."""

from __future__ import annotations

import re

import numpy as np
import pytest

from server.bent import frames_bent
from server.looks import look_in_both
from server.serving import Site
from tomoskin.board.source import open_source
from tomoskin.extras.body import BODY, BodyExamples, BodyModel
from tomoskin.pipeline import voltage_covariance
from tomoskin.run import Runner
from tomoskin.run.commands import BendRequest, SetPose
from tomoskin.server.handlers import TwinHandlers

pytestmark = [pytest.mark.page, pytest.mark.usefixtures("built_page")]

WIDTH = 0.08
PRESSURES = np.array([0, 20, 40, 60, 80, 60, 40, 20] * 4 + [0], dtype=np.float64)  # kPa
KPA_A_RAD = 80


def learnt(prepared):
    """The skin with what a pressure does to it."""
    covariance = voltage_covariance(prepared, None)
    dv = frames_bent(prepared, PRESSURES / KPA_A_RAD, WIDTH, seed=5)
    time = 0.1 * np.arange(len(dv))
    examples = BodyExamples.checked(dv, time, state=PRESSURES[:, None], names=("pressure",))
    return prepared.calibrated(BODY.of(BodyModel.learn(examples, covariance), prepared.pattern))


@pytest.fixture(scope="module")
def site(prepared):
    runner = Runner(
        learnt(prepared), lambda: open_source("twin:preset=ideal,seed=2", prepared.skin)
    )
    runner.start()
    site = Site(runner, take=TwinHandlers)
    yield site
    site.stop()
    runner.stop()


def test_the_pressure_of_a_finger_that_curls_is_beside_the_sheet(opened):
    read, words = opened.test_id("bend-note"), opened.test_id("bend-words")
    words.filter(has_text="at rest").wait_for()
    opened.site.runner.ask(SetPose(BendRequest(50 / KPA_A_RAD, length=WIDTH)))
    words.filter(has_text="moved").wait_for()
    read.filter(has_text=re.compile(r"^pressure [45]\d\.?\d* ± \d")).wait_for()
    assert opened.page.get_by_test_id("bend-value").count() == 0
    assert look_in_both(opened.page, "body") == {}
