"""Bends and stretches in a script."""

from __future__ import annotations

import math

import pytest

from tomoskin.core import ScriptError
from tomoskin.model.mesh import Arm, Hinge
from tomoskin.model.skin import Skin
from tomoskin.twin import Bent, Script, Stretched, bent, bent_truth, check_script

HEAD = 'format = 1\n[script]\nduration = "10 s"\n'
HINGE = '[[bend]]\nlength = "60 mm"\nangle = "60 deg"\nstart = "1 s"\nhold = "2 s"\n'


def script(text):
    return Script.from_toml(HEAD + text)


def test_a_hinge_goes_up_holds_and_comes_back():
    bends = script(HINGE).bends
    angle = [bends[0].amount(t) for t in (0.5, 1.5, 3.0, 4.5, 6.0)]
    assert angle == pytest.approx([0, math.pi / 6, math.pi / 3, math.pi / 6, 0])
    assert bent(bends, 3.0) == (Bent(Hinge(math.radians(60), 0.06)),)
    assert bent(bends, 0.5) == ()
    assert bent_truth(bends, 3.0) == [
        {"kind": "hinge", "angle": math.radians(60), "axis": math.pi / 2}
    ]


def test_joints_stretches_and_profiles():
    text = (
        '[[bend]]\nkind = "joint"\nradius = "30 mm"\nlength = "80 mm"\nstart = "0 s"\n'
        'profile = [["2 s", "40 deg"], ["4 s", "0 deg"]]\n'
        '[[stretch]]\nstrain = 0.1\nacross = -0.3\naxis = "30 deg"\nstart = "0 s"\nhold = "3 s"\n'
    )
    bends = script(text).bends
    joint, stretch = bent(bends, 2.0)
    assert joint == Bent(Arm(0.03, math.radians(40), 0.08))
    assert isinstance(stretch, Stretched)
    assert (stretch.along, stretch.across) == pytest.approx((0.1, -0.03))
    assert bent_truth(bends, 2.0)[1]["strain"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HINGE.replace('"60 mm"', '"60 s"'), "length"),
        (HINGE + "sharp = true\n", "sharp"),
        (HINGE.replace("hold", "profile").replace('"2 s"', '[["1 s", "9 deg"]]'), "angle|nothing"),
        (
            '[[bend]]\nlength = "60 mm"\nstart = "0 s"\nprofile = [["1 s", "9 deg"]]\n',
            "0 in the last row",
        ),
        (HINGE.replace("60 deg", "-170 deg").replace("60 mm", "5 mm"), "folds"),
        (HINGE.replace("60 deg", "200 deg"), "at most 180"),
        (HINGE.replace('"2 s"', '"20 s"'), "lasts|to end by 10"),
        (
            '[[bend]]\nkind = "joint"\nradius = "30 mm"\nlength = "10 mm"\nangle = "90 deg"\n'
            'start = "0 s"\nhold = "1 s"\n',
            "folds",
        ),
        (
            '[[bend]]\nkind = "joint"\nlength = "10 mm"\nangle = "9 deg"\nstart = "0 s"\n'
            'hold = "1 s"\n',
            "radius",
        ),
    ],
)
def test_bends_that_cannot_be_are_refused_with_their_place(text, message):
    with pytest.raises(ScriptError, match=message) as told:
        check_script(script(text), Skin.load("textile-disc-8"))
    assert "[[bend]] 1" in str(told.value)
