"""A contact that lasts is no drift: it is reported as long as it lasts, and then no more."""

from __future__ import annotations

import pytest

from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.twin import Press, SteppedSkin, TwinSettings

PRESS = Press(0.03, -0.02, force=3.0, radius=0.012)
AFTER = 100


@pytest.mark.slow
@pytest.mark.parametrize(("method", "minutes"), [("image", 5), ("fit", 2)])
def test_a_press_that_is_held_on_a_drifting_twin_stays(method, minutes):
    skin = Skin.load("textile-disc-8").altered({"touch": {"method": method}})
    twin = SteppedSkin(prepare(skin), TwinSettings.preset("textile", 13))
    steps = round(60 * minutes / twin.period)
    held = [len(twin.step((PRESS,)).touches) for _ in range(steps)]
    assert set(held[2:]) == {1}
    after = [len(twin.step(()).touches) for _ in range(AFTER)]
    assert after[-1] == 0
