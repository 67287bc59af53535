"""Scripts: what they say at a moment, and what each kind of bad script is told."""

from __future__ import annotations

import math

import pytest

from tomoskin.core import ScriptError
from tomoskin.model.skin import Skin
from tomoskin.twin.course import pressed
from tomoskin.twin.probe import Circle, Face, Finger, Square
from tomoskin.twin.script import Script, check_script

HEAD = 'format = 1\n[script]\nduration = "10 s"\n'
PRESS = """[[press]]
id = "a"
radius = "15 mm"
at = ["10 mm", "-20 mm"]
start = "1 s"
force = "3 N"
hold = "2 s"
"""
FRICTION = {"slide": 0.3, "roll": 0.02}
SKIN = Skin.load("textile-disc-8")


def script(presses: str = PRESS, head: str = HEAD) -> Script:
    return Script.from_toml(head + presses, source="my.toml")


def changed(old: str, new: str) -> str:
    assert old in PRESS
    return PRESS.replace(old, new)


def failure(presses: str = PRESS, head: str = HEAD) -> str:
    with pytest.raises(ScriptError) as caught:
        check_script(script(presses, head), SKIN)
    return str(caught.value)


def force_at(text: str, time: float) -> float:
    return sum(probe.force for probe in pressed(script(text).presses, time, FRICTION))


def test_a_press_rises_holds_and_falls() -> None:
    (press,) = script().presses
    assert press.end == pytest.approx(1 + 0.2 + 2 + 0.2)
    forces = [force_at(PRESS, time) for time in (0.99, 1.0, 1.1, 1.2, 3.2, 3.3, 3.4, 5.0)]
    assert forces == pytest.approx([0, 0, 1.5, 3, 3, 1.5, 0, 0])
    (probe,) = pressed(script().presses, 2.0, FRICTION)
    assert probe.shape == Circle(0.015)
    assert (probe.x, probe.y, probe.drag) == (0.01, -0.02, (0.0, 0.0))


def test_a_profile_is_followed_in_straight_lines() -> None:
    profile = 'profile = [["1 s", "4 N"], ["2 s", "1 N"], ["3 s", "0 N"]]'
    text = changed('force = "3 N"\nhold = "2 s"', profile)
    forces = [force_at(text, 1 + since) for since in (0.5, 1.0, 1.5, 2.5, 3.0)]
    assert forces == pytest.approx([2, 4, 2.5, 0.5, 0])


def test_a_sliding_probe_drags_the_sheet_and_a_rolling_one_hardly() -> None:
    path = 'hold = "2 s"\npath = [["1 s", "10 mm", "30 mm"], ["2 s", "-40 mm", "30 mm"]]'
    text = changed('hold = "2 s"', path)
    (early,) = pressed(script(text).presses, 1.5, FRICTION)
    assert (early.x, early.y) == pytest.approx((0.01, 0.005))
    assert early.drag == pytest.approx((0.0, 0.9))
    (late,) = pressed(script(text).presses, 2.5, FRICTION)
    assert (late.x, late.y) == pytest.approx((-0.015, 0.03))
    assert late.drag == pytest.approx((-0.9, 0.0))
    (rolling,) = pressed(script(text + 'motion = "roll"').presses, 2.5, FRICTION)
    assert rolling.drag == pytest.approx((-0.06, 0.0))
    (arrived,) = pressed(script(text).presses, 3.1, FRICTION)
    assert arrived.drag == (0.0, 0.0)


def test_shapes() -> None:
    def shape(text: str) -> object:
        return script(changed('radius = "15 mm"', text)).presses[0].shape

    assert shape('shape = "square"\nside = "15 mm"\nangle = "45 deg"') == Square(0.015)
    assert shape('shape = "finger"') == Finger()
    assert shape('radius = "15 mm"\ncrown = "15 mm"') == Circle(0.015, 0.015)
    corners = '[["0 mm", "0 mm"], ["20 mm", "0 mm"], ["0 mm", "20 mm"]]'
    triangle = shape(f'shape = "polygon"\nvertices = {corners}')
    assert isinstance(triangle, Face)
    assert triangle.area == pytest.approx(200e-6)
    turned = script(PRESS + 'angle = "45 deg"').presses[0]
    assert turned.given.angle == pytest.approx(math.pi / 4)


def test_ids_may_come_again_later() -> None:
    again = PRESS + changed('start = "1 s"', 'start = "3.4 s"')
    assert len(script(again).presses) == 2
    message = failure(PRESS + changed('start = "1 s"', 'start = "3.3 s"'))
    assert message.startswith('my.toml: [[press]] 2 "a" id: "a" already presses from 1 s to 3.4 s')


def test_a_script_of_nothing_is_an_idle_skin() -> None:
    idle = script("")
    assert (idle.presses, idle.lead_in, idle.seed) == ((), 1.0, 0)
    check_script(idle, SKIN)


@pytest.mark.parametrize(
    ("old", "new", "where", "what"),
    [
        ('force = "3 N"', 'force = "-3 N"', '[[press]] 1 "a" force', "from 0 to 1000 N"),
        ('force = "3 N"', "force = 3", '[[press]] 1 "a" force', "without a unit"),
        ('force = "3 N"', 'forse = "3 N"', '[[press]] 1 "a"', 'did you mean "force"?'),
        ('id = "a"', "", "[[press]] 1 id", "is missing"),
        ('id = "a"', "id = 7", "[[press]] 1 id", "expected text, got 7"),
        ('hold = "2 s"', "", '[[press]] 1 "a" hold', "is missing"),
        ('hold = "2 s"', 'hold = "20 s"', '[[press]] 1 "a"', "to end by 10 s, got 21.4 s"),
        ('hold = "2 s"', 'hold = "5 ms"', '[[press]] 1 "a" hold', "5 ms is shorter than a frame"),
        ('hold = "2 s"', 'hold = "2 s"\nrise = "0 s"', '[[press]] 1 "a" hold', "0 ms is shorter"),
        (
            '["10 mm", "-20 mm"]',
            '["90 mm", "60 mm"]',
            '1 "a" at',
            "got (90.0 mm, 60.0 mm), which is off",
        ),
        ('["10 mm", "-20 mm"]', '["90 mm"]', '1 "a" at', 'got ["90 mm"]'),
        ('["10 mm", "-20 mm"]', '["90 mm", 60]', '1 "a" at', "y: expected a length"),
        ('radius = "15 mm"', 'side = "15 mm"', '1 "a" radius', "is missing"),
        ('radius = "15 mm"', 'shape = "star"', '1 "a" shape', '"circle" or "square"'),
        (
            'hold = "2 s"',
            'hold = "2 s"\nprofile = [["1 s", "0 N"]]',
            '1 "a" force',
            "cannot be combined with profile",
        ),
        (
            'hold = "2 s"',
            'hold = "2 s"\npath = [["1 s", "0 mm", "0 mm"], ["1 s", "9 mm", "0 mm"]]',
            '1 "a" path',
            "row 1: expected a time after 1 s, got 1 s",
        ),
        (
            'hold = "2 s"',
            'hold = "2 s"\npath = [["2 s", "10 mm", "-120 mm"]]',
            '1 "a" path',
            "is off the skin",
        ),
        (
            'hold = "2 s"',
            'hold = "2 s"\npath = [["0 s", "10 mm", "0 mm"]]',
            '1 "a" path',
            "expected a time above 0 s",
        ),
        (
            'hold = "2 s"',
            'hold = "2 s"\npath = [["1 s", "0 mm", "0 mm"], ["1.001 s", "9 mm", "0 mm"]]',
            '1 "a" path',
            "1 ms is shorter than a frame of this skin, 56 ms",
        ),
        (
            'force = "3 N"\nhold = "2 s"',
            'profile = [["1 s", "4 N"]]',
            '1 "a" profile',
            "expected 0 in the last row, got 4",
        ),
        (
            'radius = "15 mm"',
            'shape = "polygon"\nvertices = [["0 mm", "0 mm"], ["9 mm", "0 mm"], ["5 mm", "0 mm"]]',
            '1 "a" vertices',
            "",
        ),
    ],
)
def test_a_press_that_cannot_be_meant(old: str, new: str, where: str, what: str) -> None:
    message = failure(changed(old, new))
    assert message.startswith("my.toml: ")
    assert where in message
    assert what in message


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("", "format", "is missing"),
        ("format = 2\n", "format", "expected 1, got 2"),
        ("format = [", "my.toml", "not valid TOML"),
        ('format = 1\n[script]\nduration = "-1 s"', "[script] duration", "expected a time"),
        ("format = 1\n", "[script] duration", "is missing"),
        ('format = 1\n[script]\nduration = "20 ms"', "[script] duration", "at least one frame"),
        ("format = 1\n[scrip]\n", "my.toml", 'unknown section "scrip"'),
        (HEAD + "[press]\n", "[press]", "write [[press]]"),
        (HEAD + "[[script]]\n", "my.toml", "not valid TOML"),
        (HEAD + 'press = ["a"]\n', "[script]", 'unknown key "press"'),
        ("format = 1\npress = [3]\n" + HEAD[11:], "[[press]] 1", "expected a section, got 3"),
        (HEAD + '[[mark]]\nat = "11 s"\ntext = "x"', "[[mark]] 1 at", "at most 10 s"),
        (HEAD + "seed = -1\n", "[script] seed", "whole number"),
    ],
)
def test_a_script_that_cannot_be_meant(text: str, where: str, what: str) -> None:
    message = failure("", text)
    assert message.startswith("my.toml")
    assert where in message
    assert what in message


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            changed('["10 mm", "-20 mm"]', '["90 mm", "60 mm"]'),
            (
                '[[press]] 1 "a" at: expected a position on the skin (x from -100 to 100 mm, y',
                "got (90.0 mm, 60.0 mm)",
                "(the middle of a probe must be inside the outline)",
            ),
        ),
        (
            changed('force = "3 N"', 'force = "-3 N"'),
            ('[[press]] 1 "a" force: expected a force from 0 to 1000 N, got "-3 N"',),
        ),
        (
            changed('force = "3 N"', 'farce = "3 N"'),
            ('"a": unknown key "farce" (did you mean "fo',),
        ),
        (
            PRESS + changed('start = "1 s"', 'start = "3.3 s"'),
            ('2 "a" id: "a" already', "1 s to 3.4 s", "(two presses at once need different ids)"),
        ),
        (
            changed('hold = "2 s"', 'hold = "9 s"'),
            ('1 "a": expected it to end by 10 s, got 10.4 s (raise [script] duration)',),
        ),
        (
            changed('hold = "2 s"', 'hold = "5 ms"'),
            (
                "hold: a stage of 5 ms",
                "a frame of this skin, 56 ms",
                "make it longer, or shorten [readout]",
            ),
        ),
    ],
)
def test_an_error_says_where_what_was_expected_and_found_and_what_to_do(
    text: str, parts: tuple[str, ...]
) -> None:
    message = failure(text)
    assert message.startswith("my.toml: [[press]] ")
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("keys", "where", "what"),
    [
        ('kind = "cut"\nend = "1.01 s"\nelectrode = 2', "end", "10 ms, shorter than a frame"),
        ('kind = "cut"\nend = "1.4 s"\nelectrode = 8', "electrode", "from 0 (E1) to 7, got 8"),
        ('kind = "rail"\nend = "0.4 s"\nelectrode = 2', "end", "after start, 1 s, got 0.4 s"),
        (
            'kind = "short"\nend = "2 s"\nelectrode = 2\nother = 2',
            "other",
            "expected an electrode other than E3, got the same",
        ),
        ('kind = "los"', "kind", 'or "temperature", got "los"'),
        ('kind = "reboot"\nend = "2 s"', "end", "needs kind"),
        ('kind = "loss"\nend = "2 s"\nprobability = 1.5', "probability", "0 to 0.999, got 1.5"),
        ('kind = "noise"\nend = "2 s"', "lsb", "is missing"),
        ('kind = "temperature"\nkelvin = "warm"', "kelvin", "expected a number"),
    ],
)
def test_a_fault_that_cannot_be_meant(keys: str, where: str, what: str) -> None:
    message = failure(f'[[fault]]\nstart = "1 s"\n{keys}\n')
    assert message.startswith(f"my.toml: [[fault]] 1 {where}: ")
    assert what in message


def test_a_board_that_reads_before_it_has_settled() -> None:
    """The textile's board settles with 11 us: 4.6 of these leave a hundredth of a step."""
    enough, short = (SKIN.altered({"readout": {"settling": s}}) for s in ("60 us", "22 us"))
    check_script(script(), enough)
    with pytest.raises(ScriptError) as caught:
        check_script(script(), short)
    assert str(caught.value) == (
        f"{short.source}: [readout] settling: expected at least 51 us, got 22 us: the textile "
        "board settles with a time constant of 11 us, and 14 % of each sample would come from the "
        "drive before (make it longer, or choose another preset)"
    )
    check_script(script(head=HEAD + 'preset = "ideal"\n'), short)


def test_frames_that_take_longer_than_a_stage() -> None:
    """A settling time of 100 ms: a scan of eight drives takes 0.8 s."""
    slow = SKIN.altered({"readout": {"settling": "100 ms"}})
    with pytest.raises(ScriptError, match=r'1 "a" hold: a stage of 200 ms .* this skin, 840 ms'):
        check_script(script(), slow)
