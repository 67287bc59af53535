"""Weights on the skin, frame by frame: what is recorded when, and what that tells."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tomoskin.core import DataError, Detection, Touch, WireError
from tomoskin.learning import DEPTH, FORCE, AmountLabel
from tomoskin.server.amount_flow import DepthFlow, ForceFlow, PlacementTaker, labelled_presses
from tomoskin.server.requests import DeletePress, SetLabel, decode_request

RATE = 0.04
SEEN = "host_time", "touches"
AREA = math.pi * 4e-4


def touch(number, newtons, x=0.0, y=0.0, sheet=0.01):
    depth = 0.4 * newtons / (newtons + 5.0)
    peak = sheet * math.expm1(-depth)
    found = Detection(x, y, 1e-3, 1e-3, AREA, peak, np.empty(0, np.int64), snr=60.0)
    return Touch(number, "decrease", 0.0, found)


class Bench:
    """A skin on which weights are laid; ``see`` takes each frame's touches."""

    def __init__(self, see):
        self.time, self.number, self._see = 100.0, 0, see

    def show(self, *touches, frames=1):
        seen = []
        for _ in range(frames):
            self.time += RATE
            seen.append(self._see(self.time, touches))
        return [one for one in seen if one is not None]

    def lay(self, newtons, x=0.0, y=0.0, frames=24):
        """Lowered within five frames, then it lies."""
        self.number += 1
        for part in (0.2, 0.4, 0.6, 0.8):
            self.show(touch(self.number, newtons * part, x, y))
        return self.show(touch(self.number, newtons, x, y), frames=frames)

    def lift(self):
        return self.show(frames=4)


def test_what_lies_still_is_taken_once_with_the_way_there():
    taker = PlacementTaker()
    bench = Bench(taker.push)
    bench.lift()
    assert taker.phase == "press"
    (placement,) = bench.lay(5.0, 0.02, 0.03, frames=40)
    assert placement.xy == (0.02, 0.03)
    assert placement.still >= 4, "not while it is lowered"
    assert len(placement.detections) >= 8
    assert abs(placement.detections[0].peak) < abs(placement.detections[placement.still].peak)
    assert taker.phase == "release"
    bench.lift()
    assert taker.phase == "press"


def test_a_hand_that_still_lowers_it_is_waited_for():
    taker = PlacementTaker()
    bench = Bench(taker.push)
    bench.lift()
    lowered = [bench.show(touch(1, 1.0 * 1.04**k)) for k in range(40)]
    assert not any(lowered)
    slid = [bench.show(touch(2, 5.0, x=1e-3 * k)) for k in range(40)]
    assert not any(slid)
    assert taker.phase == "hold"


def test_two_things_at_once_are_no_placement_and_one_that_lay_there_before_neither():
    taker = PlacementTaker()
    bench = Bench(taker.push)
    bench.show(touch(1, 5.0), frames=40)
    assert taker.phase == "rest"
    bench.lift()
    assert not bench.show(touch(2, 5.0), touch(3, 5.0, 0.05), frames=40)
    assert taker.phase == "several"
    assert len(bench.show(touch(2, 5.0), frames=40)) == 1


@pytest.fixture
def flow(prepared):
    flow = ForceFlow(prepared)

    def see(time, touches):
        return flow.see(SimpleNamespace(host_time=time, touches=touches)) or None

    return flow, Bench(see)


def set_weight(flow, value, unit="N", *, sure=False):
    return flow.answers[SetLabel](SetLabel(value, unit, sure))


def weigh(flow, bench, newtons, x, y, *, said=None):
    bench.lift()
    set_weight(flow, newtons if said is None else said)
    assert bench.lay(newtons, x, y) == [True]


PLACES = [(0.06 * math.cos(k), 0.06 * math.sin(k)) for k in range(12)]
TOPS = (1.0, 4.0, 2.0, 8.0, 3.0, 6.0, 1.5, 9.0, 2.5, 5.0, 7.0, 1.2)


def test_ten_weights_are_learnt_from_saved_and_used(flow, tmp_path):
    flow, bench = flow
    for k, newtons in enumerate(TOPS[:4]):
        weigh(flow, bench, newtons, *PLACES[k])
    assert flow.estimate_from(flow.examples()).text == "1 press more for a first answer"
    for k, newtons in enumerate(TOPS[4:10], 4):
        weigh(flow, bench, newtons, *PLACES[k])
    estimate = flow.estimated(flow.examples())
    assert estimate.ready
    assert "Ten are enough" in estimate.text
    assert np.abs(estimate.figures.errors).mean() < 0.2
    skin = flow.prepared.skin
    assert skin.outline.contains(estimate.place[None]).all()
    path = tmp_path / "force.npz"
    FORCE.of(estimate.answer, flow.prepared.pattern, skin).write(path)
    again = FORCE.read(path).model
    (force,), _ = again.read(None, [touch(1, 4.0, *PLACES[1]).detection], 0.0)
    assert force.value == pytest.approx(4.0, rel=0.25)
    assert force.low < force.value < force.high
    flow.estimate = estimate
    fields = flow.now()
    assert fields.labels[3] == "8 N"
    assert fields.phase == "release"


def test_a_wrong_label_is_named_and_can_be_deleted(flow):
    flow, bench = flow
    for k, newtons in enumerate(TOPS):
        weigh(flow, bench, newtons, *PLACES[k], said=10.0 if k == 6 else None)
    estimate = flow.estimated(flow.examples())
    assert estimate.figures.doubtful == [6]
    assert "enough without the problems below" in estimate.text
    named = "Press 7: the label 10 N contradicts"
    assert any(remark.startswith(named) for remark in estimate.figures.remarks)
    assert flow.answers[DeletePress](DeletePress(6))
    estimate = flow.estimated(flow.examples())
    assert estimate.figures.doubtful == []
    assert flow.answers[DeletePress](DeletePress())
    assert len(flow.examples()) == 10
    with pytest.raises(WireError, match="no press"):
        flow.answers[DeletePress](DeletePress(10))


def test_weights_that_contradict_and_one_spot_are_said_in_the_words_of_the_command(flow):
    flow, bench = flow
    for newtons in TOPS[:8]:
        weigh(flow, bench, newtons, 0.01, 0.01)
    remarks = flow.estimated(flow.examples()).figures.remarks
    assert any("all presses lie within" in remark for remark in remarks)
    for k, newtons in enumerate(TOPS[:8]):
        weigh(flow, bench, newtons, *PLACES[k], said=10.0 / newtons)
    flow.answers[DeletePress](DeletePress(0))
    contradicting = flow.examples()[7:]
    with pytest.raises(DataError, match="the weights contradict"):
        flow.estimated(contradicting)


def test_a_placement_that_is_refused_says_why(flow):
    flow, bench = flow
    set_weight(flow, 4.0)
    bench.lift()
    assert not bench.lay(4.0, frames=5)
    bench.lift()
    assert "lifted before it had rested" in flow.now().text
    bench.number += 1
    for k in range(90):
        bench.show(touch(bench.number, 4.0, 1e-3 * k))
    assert "it still moves" in flow.now().text
    assert not flow.examples()
    bench.lift()
    assert bench.lay(4.0)
    assert "recorded" not in flow.now().text


def test_grams_taken_for_newtons_are_asked_about(flow):
    flow, _ = flow
    set_weight(flow, 200.0)
    fields = flow.now()
    assert fields.asked.text == "200 N"
    assert fields.meant.text == "200 g (1.96 N)"
    assert fields.label is None
    with pytest.raises(WireError, match="up to 100 N"):
        set_weight(flow, 200.0, sure=True)
    set_weight(flow, 200.0, "g", sure=True)
    assert flow.label == AmountLabel(200.0, "g")
    set_weight(flow, 30.0, sure=True)
    assert flow.label.si == 30.0
    set_weight(flow, 0.5, "g")
    assert flow.now().meant.text == "0.5 kg (4.9 N)"


@pytest.mark.parametrize("value", ["0", "-3", "1e9"])
@pytest.mark.parametrize("unit", ["g", "kg", "N"])
def test_a_weight_that_cannot_be_is_refused_in_words(flow, value, unit):
    """Not as a message that is not understood: a person typed it."""
    flow, _ = flow
    asked = f'{{"type": "flow_label", "value": {value}, "unit": "{unit}", "sure": true}}'
    request = decode_request(asked)
    with pytest.raises(WireError, match="expected a weight above 0 and up to 100 N"):
        flow.answers[type(request)](request)
    assert float(value) > 0 or AmountLabel(float(value), unit).meant is None


def test_a_weight_that_is_named_after_it_lay_there_is_recorded_then(flow):
    flow, bench = flow
    bench.lift()
    assert not bench.lay(5.0)
    assert flow.now().phase == "name"
    assert set_weight(flow, 510.0, "g")
    ((_, label),) = flow.examples()
    assert label.si == pytest.approx(5.0, rel=0.01)
    with pytest.raises(DataError, match="at least 5"):
        labelled_presses(flow.examples())


def test_depths_are_learnt_by_the_same_flow_within_the_layer(prepared):
    prepared = replace(prepared, skin=prepared.skin.altered({"surface": {"layer": "3 mm"}}))
    flow = DepthFlow(prepared)
    bench = Bench(lambda *seen: flow.see(SimpleNamespace(**dict(zip(SEEN, seen, strict=True)))))
    for wrong, unit, reason in ((5.0, "mm", "the layer under the sheet"), (2.0, "N", "got 2 N")):
        with pytest.raises(WireError, match=f"expected a depth above 0 and up to 3 mm.*{reason}"):
            set_weight(flow, wrong, unit)
    for k, newtons in enumerate(TOPS[:6]):
        bench.lift()
        set_weight(flow, 0.1 * newtons, "mm")
        bench.lay(newtons, *PLACES[k])
    answer = flow.estimated(flow.examples()).answer
    assert (answer.presses.measurand, flow.teaches) == ("depth", DEPTH)
    assert np.sort(answer.presses.amount[answer.presses.labelled]) == pytest.approx(
        1e-4 * np.sort(TOPS[:6])
    )
    assert flow.now().labels[3] == "0.8 mm"
