"""Force and depth from labelled presses: synthetic touches of a law that is known."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tomoskin.core import DataError, Detection, load_arrays, save_arrays
from tomoskin.learning import (
    DEPTH,
    FORCE,
    AmountModel,
    AmountProcess,
    LabelledPresses,
)
from tomoskin.model.skin import MaterialMemory, MemoryState, Skin, advanced, followed

SHEET, UNIT = 0.1, 0.1
LAW = MaterialMemory(play=(0.25,), play_widths=(0.04,))
LOOP = (0.4, 0.7, 1.0, 0.7, 0.4)


def touch(x, y, depth, snr=60.0, area=np.pi * 9e-4):
    return Detection(
        x, y, 1e-3, 1e-3, area, SHEET * np.expm1(-depth), np.empty(0, np.int64), snr=snr
    )


def press(rng, top, steps=LOOP, memory=LAW):
    """Touches and forces of one press at a random spot: the skin is stiffer towards its rim."""
    x, y = rng.uniform(-0.06, 0.06, 2)
    level = 0.4 * np.exp(-0.3 * (x * x + y * y) / UNIT**2)
    state, touches, forces = MemoryState.fresh(memory), [], []
    for part in steps:
        force = top * part
        state = advanced(state, memory, np.array([[level * force / (force + 5.0)]]), 0.5)
        touches.append(touch(x, y, followed(state, memory)[0][0] * np.exp(0.03 * rng.normal())))
        forces.append(force)
    return touches, forces


def presses(seed, count=20, steps=LOOP, tops=None):
    rng = np.random.default_rng(seed)
    touches, forces, number = [], [], []
    tops = rng.permutation(np.geomspace(2.0, 20.0, count)) if tops is None else tops
    for k, top in enumerate(tops):
        more, known = press(rng, float(top), steps)
        touches += more
        forces += known
        number += [k] * len(more)
    return touches, np.array(forces), np.array(number), 0.5 * np.arange(len(touches))


@cache
def learnt():
    return AmountModel.learn(LabelledPresses.of(*presses(1)), SHEET, UNIT)


def read(model, touches):
    state, forces = None, []
    for k, one in enumerate(touches):
        (force,), state = model.read(state, [one], 0.5 * k)
        forces.append(force)
    return forces


def test_held_out_presses_are_weighed_while_loading_and_unloading():
    model = learnt()
    assert model.memory.play
    assert model.held >= 0.85
    rng, errors, held = np.random.default_rng(77), [], []
    for top in rng.uniform(3, 18, 60):
        touches, known = press(rng, float(top))
        for force, true in zip(read(model, touches), known, strict=True):
            errors.append(abs(force.value / true - 1))
            held.append(force.low <= true <= force.high)
    assert np.mean(errors) < 0.10
    assert 0.80 < np.mean(held) < 0.98


def test_the_memory_is_what_makes_loading_and_unloading_agree():
    model, rng = learnt(), np.random.default_rng(5)
    loop, alone = [], []
    for _ in range(12):
        touches, _ = press(rng, 8.0)
        with_past = read(model, touches)
        loop.append(with_past[-1].value / with_past[0].value)
        (fresh,), _ = model.read(None, [touches[-1]], 0.0)
        alone.append(fresh.value / with_past[0].value)
    assert abs(np.mean(loop) - 1) < 0.1 < np.mean(alone) - 1


def test_a_press_that_is_held_for_an_hour_keeps_its_force():
    law = MaterialMemory((0.25,), (0.04,), creep=(0.04, 0.03), creep_times=(1.0, 30.0))
    rng, touches, forces, number = np.random.default_rng(3), [], [], []
    for k, top in enumerate(np.geomspace(2.0, 20.0, 20)):
        more, known = press(rng, float(top), LOOP, law)
        touches, forces, number = touches + more, forces + known, number + [k] * len(more)
    times = 0.5 * np.arange(len(touches))
    model = AmountModel.learn(LabelledPresses.of(touches, forces, number, times), SHEET, UNIT)
    held, state, spots, now = [], MemoryState.fresh(law), None, 0.0
    for seconds in (0.5, 60.0, 600.0, 3000.0):
        state = advanced(state, law, np.array([[0.4 * 8.0 / 13.0]]), seconds)
        now += seconds
        (force,), spots = model.read(spots, [touch(0.0, 0.0, followed(state, law)[0][0])], now)
        held.append(force.value)
    assert held == pytest.approx([held[0]] * 4, rel=0.1)


def test_reading_is_pure_and_a_spot_goes_on_where_it_was():
    model, rng = learnt(), np.random.default_rng(6)
    touches, _ = press(rng, 8.0)
    _, state = model.read(None, [touches[2]], 0.0)
    first = model.read(state, [touches[3]], 0.5)
    second = model.read(state, [touches[3]], 0.5)
    assert first[0] == second[0]
    assert len(first[1]) == 1
    released = model.read(state, [], 1.0)[1]
    assert len(released) == 1
    assert released.memory.lagging[0, 0, 0] > 0  # what the press left there
    forces, both = model.read(state, [touches[3], touch(-0.05, 0.05, 0.2)], 0.5)
    assert forces[0].value == pytest.approx(first[0][0].value, rel=1e-12)
    assert len(both) == 2


def test_beyond_what_was_taught_a_force_is_only_said_to_be_more():
    model = AmountModel.learn(
        LabelledPresses.of(*presses(4, tops=np.geomspace(1.0, 8.0, 20))), SHEET, UNIT
    )
    rng, beyond = np.random.default_rng(9), []
    for top in rng.uniform(9.0, 25.0, 60):
        touches, _ = press(rng, float(top), steps=(1.0,))
        (force,) = read(model, touches)
        beyond.append((force, force.low <= top <= force.high))
    assert np.mean([held for _, held in beyond]) >= 0.9
    assert all(force.high == np.inf for force, _ in beyond if force.value > 8.0)
    assert all(force.low <= model.most for force, _ in beyond)


def test_a_noisy_touch_has_a_wider_interval():
    model = learnt()
    clear, noisy = (
        model.read(None, [touch(0.0, 0.0, 0.2, snr)], 0.0)[0][0] for snr in (60.0, 4.0)
    )  # fmt: skip
    assert noisy.high / noisy.low > 1.5 * clear.high / clear.low


def test_a_file_gives_the_same_forces(tmp_path):
    skin = Skin.load("textile-disc-8")
    model = AmountModel.fit(LabelledPresses.of(*presses(2, count=6)), skin)
    path = tmp_path / "force.npz"
    FORCE.of(model, skin.pattern(), skin).write(path)
    again = FORCE.read(path)
    again.check(skin)
    one = touch(0.01, 0.02, 0.15)
    assert again.model.read(None, [one], 0.0)[0] == model.read(None, [one], 0.0)[0]


def test_the_calibration_of_another_skin_is_refused():
    skin = Skin.load("textile-disc-8")
    model = AmountModel.fit(LabelledPresses.of(*presses(2, count=6)), skin)
    calibration = FORCE.of(model, skin.pattern(), skin)
    with pytest.raises(DataError, match="another scan"):
        calibration.check(Skin.load("textile-disc-16"))
    other = "fit" if skin.touch.method == "image" else "image"
    with pytest.raises(DataError, match="touches found by"):
        calibration.check(skin.altered({"touch": {"method": other}}))
    with pytest.raises(DataError, match="to another sheet"):
        calibration.check(skin.altered({"material": {"sheet_resistance": "7 ohm/sq"}}))


def test_grams_are_not_newtons():
    touches, forces, number, time = presses(1)
    with pytest.raises(DataError, match="1 N is the weight of 102 g, so the unit") as raised:
        LabelledPresses.of(touches, 102 * forces, number, time)
    assert "--unit g" in str(raised.value)


def dips(seed, count=20, power=1.2):
    """Touches and depths, m: deeper ones change the sheet by more than in proportion."""
    rng = np.random.default_rng(seed)
    depths = rng.permutation(np.geomspace(0.2e-3, 1.2e-3, count))
    noise = np.exp(0.03 * rng.normal(size=count))
    levels = 0.3 * (depths / 0.5e-3) ** power * noise
    touches = [touch(*rng.uniform(-0.06, 0.06, 2), level) for level in levels]
    return touches, depths, np.arange(count), np.arange(float(count))


def test_depths_are_learnt_as_forces_are(tmp_path):
    skin = Skin.load("textile-disc-8")
    sheet = skin.conductivity / SHEET

    def seen(touches):
        return [replace(one, peak=one.peak * sheet) for one in touches]

    touches, *labels = dips(1)
    model = AmountModel.fit(LabelledPresses.of(seen(touches), *labels, "depth"), skin)
    touches, depths, *_ = dips(2, 60)
    shown = [model.read(None, [one], 0.0)[0][0] for one in seen(touches)]
    errors = [abs(amount.value / true - 1) for amount, true in zip(shown, depths, strict=True)]
    held = [amount.low <= true <= amount.high for amount, true in zip(shown, depths, strict=True)]
    assert np.mean(errors) < 0.06
    assert 0.8 <= np.mean(held) <= 1.0
    path = tmp_path / "depth.npz"
    DEPTH.of(model, skin.pattern(), skin).write(path)
    assert DEPTH.read(path).model.read(None, seen(touches[:1]), 0.0)[0][0] == shown[0]
    with pytest.raises(DataError, match="is not a calibration of forces"):
        FORCE.read(path)


def test_a_file_of_before_still_opens(tmp_path):
    """Its labels were newtons, and nothing said so."""
    skin, path = Skin.load("textile-disc-8"), tmp_path / "force.npz"
    model = AmountModel.fit(LabelledPresses.of(*presses(2, count=6)), skin)
    FORCE.of(model, skin.pattern(), skin).write(path)
    arrays = dict(load_arrays(path))
    del arrays["measurand"]
    arrays["force_n"] = arrays.pop("amount")
    save_arrays(path, arrays, overwrite=True)
    one = touch(0.01, 0.02, 0.15)
    assert FORCE.read(path).model.read(None, [one], 0.0)[0] == model.read(None, [one], 0.0)[0]


def test_depths_in_another_unit_or_beyond_the_layer_are_refused():
    touches, depths, number, time = dips(1)
    with pytest.raises(DataError, match="50 mm, so the unit is probably another"):
        LabelledPresses.of(touches, 1e3 * depths, number, time, "depth")
    with pytest.raises(DataError, match="the unit is probably another"):
        LabelledPresses.of(touches, 1e-3 * depths, number, time, "depth")
    skin = Skin.load("textile-disc-8").altered({"surface": {"layer": "1 mm"}})
    beyond = LabelledPresses.of(touches, depths, number, time, "depth")
    with pytest.raises(DataError, match=r"under the sheet, 1 mm, got 0\.2 to 1\.2 mm"):
        AmountModel.fit(beyond, skin)
    contrary = LabelledPresses.of(touches, 1.4e-3 - depths, number, time, "depth")
    with pytest.raises(DataError, match="larger depths do not cause larger changes"):
        AmountModel.learn(contrary, SHEET, UNIT)


def test_weights_that_contradict_are_refused():
    touches, forces, number, time = presses(1)
    with pytest.raises(DataError, match="the weights contradict"):
        AmountModel.learn(LabelledPresses.of(touches, 22 - forces, number, time), SHEET, UNIT)


def test_one_wrong_label_is_named():
    touches, forces, number, time = presses(1)
    wrong = np.where(number == 4, 5 * forces, forces)
    assert wrong.max() < 100
    model = AmountModel.learn(LabelledPresses.of(touches, wrong, number, time), SHEET, UNIT)
    assert {remark.press for remark in model.remarks} == {4}
    assert "contradicts the other presses" in model.remarks[0].reason


def test_presses_at_one_spot_say_what_they_can_promise():
    touches, forces, number, time = presses(1)
    here = [touch(0.001, 0.0, -np.log1p(t.peak / SHEET)) for t in touches]
    model = AmountModel.learn(LabelledPresses.of(here, forces, number, time), SHEET, UNIT)
    assert any("elsewhere forces are less certain" in remark.reason for remark in model.remarks)
    spot, rim = (model.read(None, [touch(x, 0.0, 0.2)], 0.0)[0][0] for x in (0.0, 0.08))
    assert rim.high / rim.low > 1.2 * spot.high / spot.low


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f, p, t: (f[:-1], p, t), "a force, a press and a time for each"),
        (lambda f, p, t: (np.where(p < 1, f, np.nan)[:4], p[:4], t[:4]), "at least 5|for each"),
        (lambda f, p, t: (-f, p, t), "forces above 0, got"),
        (lambda f, p, t: (f, p, t[::-1]), "the time decreases within press"),
    ],
)
def test_labels_that_do_not_belong_together(change, message):
    touches, *labels = presses(1)
    with pytest.raises(DataError, match=message):
        LabelledPresses.of(touches, *change(*labels))


def test_one_press_alone_cannot_be_checked():
    touches, forces, _, time = presses(1, count=2)
    with pytest.raises(DataError, match="at least two presses, got one press"):
        AmountModel.learn(
            LabelledPresses.of(touches, forces, np.zeros(len(forces), int), time), SHEET, UNIT
        )


# Newtons from measurements.


def measured(n, seed):
    """A skin that drifts: its rest tells how much."""
    rng = np.random.default_rng(seed)
    mix = np.random.default_rng(3).normal(size=(3, 12))
    drift = np.sin(np.arange(n) / 9) + 0.2 * rng.normal(size=n)
    force, other = rng.uniform(0.1, 2.0, n), rng.normal(size=n)
    before = 5 + np.outer(drift, mix[2]) + 0.005 * rng.normal(size=(n, 12))
    change = np.outer(force * np.exp(0.4 * drift), mix[0]) + 0.3 * np.outer(other, mix[1])
    return before, before + change + 0.005 * rng.normal(size=(n, 12)), force


def test_the_rest_before_a_press_tells_what_the_skin_remembers():
    before, during, force = measured(160, 1)
    model = AmountProcess.fit(before[:120], during[:120], force[:120])
    found, low, high = model.predict(before[120:], during[120:])
    assert np.abs(found - force[120:]).mean() < 0.1 * np.abs(force - force.mean()).mean() + 0.02
    assert ((low <= force[120:]) & (force[120:] <= high)).mean() > 0.75
    other = before[0] + 0.005 * np.random.default_rng(2).normal(size=before.shape)
    pressed = other + during - before
    blind = AmountProcess.fit(other[:120], pressed[:120], force[:120])
    worse, *_ = blind.predict(other[120:], pressed[120:])
    assert np.abs(worse - force[120:]).mean() > 1.5 * np.abs(found - force[120:]).mean()


def test_presses_that_do_not_belong_together():
    before, during, force = measured(30, 1)
    with pytest.raises(DataError, match="at least 20 presses"):
        AmountProcess.fit(before[:10], during[:10], force[:10])
    with pytest.raises(DataError, match="finite amounts that differ"):
        AmountProcess.fit(before, during, 0 * force + 1)
    with pytest.raises(DataError, match="expected dv of shape"):
        AmountProcess.fit(before, during, force).predict(before[:, 1:], during[:, 1:])
