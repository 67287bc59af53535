"""A twin that is pressed step by step: what a learner gets, the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import GeometryError
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

PRESS = Press(0.03, -0.02, force=5.0, radius=0.012)
PREPARED = prepare(Skin.load("textile-disc-8"))


@pytest.fixture(scope="module")
def skin():
    return SteppedSkin(PREPARED, TwinSettings.preset("textile", 4))


def episode(skin, seed=None):
    """Voltages and touches of a press and what comes after it."""
    first = skin.reset(seed)
    steps = [skin.step((PRESS,) if n < 8 else ()) for n in range(16)]
    return np.array([first.voltages, *(step.voltages for step in steps)]), [
        s.touches for s in steps
    ]


def test_a_press_is_a_touch_as_long_as_it_lasts(skin):
    voltages, touches = episode(skin)
    assert voltages.shape == (17, PREPARED.pattern.n_meas)
    assert [len(found) for found in touches[1:8]] == [1] * 7  # a touch must stand for two frames
    assert touches[-1] == ()
    place = touches[7][0].detection
    assert np.hypot(place.x - PRESS.x, place.y - PRESS.y) < 0.015


def test_an_episode_repeats_itself_with_its_seed_only(skin):
    first, again, other = (episode(skin, seed)[0] for seed in (7, 7, 8))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.array_equal(episode(skin)[0], other)  # without one it is that of the episode before


def test_voltages_alone_are_the_same(skin):
    alone = SteppedSkin(PREPARED, TwinSettings.preset("textile", 4), with_touches=False)
    alone.reset(7)
    skin.reset(7)
    assert alone.step((PRESS,)).touches == ()
    quiet = SteppedSkin(PREPARED, TwinSettings.preset("ideal", 4).with_noise(0.0))
    bare = SteppedSkin(
        PREPARED, TwinSettings.preset("ideal", 4).with_noise(0.0), with_touches=False
    )
    assert np.array_equal(quiet.step((PRESS,)).voltages, bare.step((PRESS,)).voltages)


def test_a_press_off_the_skin_is_refused(skin):
    skin.reset(7)
    with pytest.raises(GeometryError):
        skin.step((Press(1.0, 0.0, force=5.0, radius=0.012),))
    assert skin.step(()).touches == ()
    assert skin.period == pytest.approx(0.056, abs=0.002)
