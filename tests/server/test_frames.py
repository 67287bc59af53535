"""The binary message, read back as the page reads it: by offsets, not by our own types."""

import json
import math
import struct
from dataclasses import replace
from typing import ClassVar

import msgspec
import numpy as np
import pytest

from files.session.runs import FOLD, STRETCH
from tomoskin.core import Amount, Detection, Image, Touch
from tomoskin.learning import CalibrationHealth, DentMap, Reading, ShownReading
from tomoskin.pipeline import FrameResult
from tomoskin.sensing.fit import Deformation
from tomoskin.server.frames import encode_result
from tomoskin.server.page_messages import DeformationNow
from tomoskin.twin import Finger, Press, Probe

HEADER = (
    *("magic", "sequence", "host_time", "n_cells", "n_meas"),
    *("n_touches", "n_truth", "flags", "latency_us", "n_dent"),
)


def make(n_cells=5, touches=(), **changes):
    fields = {
        "sequence": 7,
        "host_time": 12.5,
        "ready": True,
        "has_image": True,
        "image": Image(np.linspace(-1, 1, n_cells), "S", "m"),
        "voltages": np.array([0.1, 0.2, 0.3]),
        "reference": np.array([0.4, 0.5, 0.6]),
        "touches": touches,
        "left_out": 0,
    }
    return FrameResult(**(fields | changes))


def touch(number, cells, kind="decrease", sd=0.001):
    reading = Detection(0.01, -0.02, sd, sd, 2e-4, -0.3, np.array(cells))
    return Touch(number, kind, 10.0, reading)


def decode(data):
    """By the contract's table alone."""
    head = dict(zip(HEADER, struct.unpack_from("<4sIdIIHHIII", data), strict=True))
    at = 40

    def floats(n):
        nonlocal at
        found = struct.unpack_from(f"<{n}f", data, at)
        at += 4 * n
        return found

    head["image"] = floats(head["n_cells"])
    head["voltages"] = floats(head["n_meas"])
    head["reference"] = floats(head["n_meas"])
    head["touches"], head["amounts"] = [], []
    for _ in range(head["n_touches"]):
        number, kind = struct.unpack_from("<IB", data, at)
        head["touches"].append((number, kind, *struct.unpack_from("<8f", data, at + 8)))
        head["amounts"].append(struct.unpack_from("<6f", data, at + 40))
        at += 64
    head["truth"] = [floats(4) for _ in range(head["n_truth"])]
    head["labels"] = list(data[at : at + head["n_cells"]])
    at += math.ceil(head["n_cells"] / 4) * 4
    n = head["n_dent"]
    head["dent"] = np.reshape(struct.unpack_from(f"<{2 * n}H", data, at), (2, n)) * 2e-6
    at += 4 * n
    head["readings"] = json.loads(data[at:] or b"{}")
    return head


@pytest.mark.parametrize("n_cells", [4, 5, 6, 7])
def test_round_trip(n_cells):
    touches = (touch(3, [0, 1]), touch(300, [3], "increase", math.nan))
    data = encode_result(make(n_cells, touches), [Press(0.5, -0.25, 3.0, 0.015)], 0.00025)
    found = decode(data)
    assert found["magic"] == b"TSK1"
    assert found["sequence"] == 7
    assert found["host_time"] == 12.5
    assert found["flags"] == 1
    assert found["latency_us"] == 250
    np.testing.assert_allclose(found["image"], np.linspace(-1, 1, n_cells), rtol=1e-6)
    np.testing.assert_allclose(found["voltages"], [0.1, 0.2, 0.3], rtol=1e-6)
    np.testing.assert_allclose(found["reference"], [0.4, 0.5, 0.6], rtol=1e-6)
    first, second = found["touches"]
    assert first == pytest.approx((3, 0, 0.01, -0.02, 0.001, 0.001, 2e-4, -0.3, 2.5, 0))
    assert second[:2] == (300, 1)
    assert math.isnan(second[4])
    assert found["truth"] == [pytest.approx((0.5, -0.25, 3.0, 0.015))]
    assert found["labels"] == [1, 1, 0, 2] + [0] * (n_cells - 4)


def test_a_dent_that_is_asked_for_follows_the_labels():
    dent = DentMap(np.array([0.0, 1.234e-3, 5.0]), np.array([1e-6, 2e-4, 0.0]))
    found = decode(encode_result(make(), [], 0.0, dent))
    assert found["dent"][0] == pytest.approx([0, 1.234e-3, 0.13107])
    assert found["dent"][1] == pytest.approx([0, 2e-4, 0], abs=1e-6)
    assert decode(encode_result(make(), [], 0.0))["dent"].size == 0


def test_nothing_to_tell():
    found = decode(encode_result(make(ready=False), [], 0.0))
    assert found["flags"] == 0
    assert found["touches"] == found["truth"] == []
    assert not any(found["labels"])


def test_flags():
    assert decode(encode_result(make(left_out=2), [], 0.0))["flags"] == 0b101
    assert decode(encode_result(make(left_out=2, has_image=False), [], 0.0))["flags"] == 0b111


def test_numbers_that_do_not_fit_are_held_at_their_ends():
    found = decode(encode_result(make(sequence=2**32 + 5), [], 1e9))
    assert found["sequence"] == 5
    assert found["latency_us"] == 2**32 - 1
    assert decode(encode_result(make(), [], -1.0))["latency_us"] == 0


def test_a_touch_says_how_many_it_stands_for():
    alone, several = touch(1, [0]), touch(2, [1])
    several = replace(several, detection=replace(several.detection, close=True))
    merged = replace(touch(3, [2]), merged=(3, 5, 8))
    data = encode_result(make(5, (alone, several, merged)), [], 0.0)
    at = len(data) - 8 - 3 * 64
    assert [data[at + 64 * k + 5] for k in range(3)] == [0, 1, 3]


def test_a_touch_says_whether_a_scan_has_confirmed_it():
    early = replace(touch(1, [0]), provisional=True)
    data = encode_result(make(5, (early, touch(2, [1]))), [], 0.0)
    at = len(data) - 8 - 2 * 64
    assert [data[at + 64 * k + 7] for k in range(2)] == [1, 0]


def test_a_touch_says_whether_the_robot_itself_makes_it():
    data = encode_result(make(5, (touch(1, [0]), touch(7, [1]))), [], 0.0, own={7})
    at = len(data) - 8 - 2 * 64
    assert [data[at + 64 * k + 6] for k in range(2)] == [0, 1]


def test_a_touch_carries_its_force_and_its_depth():
    none, forced, deep = touch(1, [0]), touch(2, [1]), touch(3, [2])
    forced = replace(forced, detection=replace(forced.detection, force=Amount(4.0, 3.5, 4.75)))
    deep = replace(deep, detection=replace(deep.detection, depth=Amount(0.5, 0.25, math.inf)))
    found = decode(encode_result(make(5, (none, forced, deep)), [], 0.0))["amounts"]
    assert all(map(math.isnan, found[0]))
    assert found[1][:3] == (4.0, 3.5, 4.75)
    assert found[2][3:] == (0.5, 0.25, math.inf)
    assert all(map(math.isnan, (*found[1][3:], *found[2][:3])))


def test_a_touch_carries_its_whole_covariance():
    first = touch(1, [0])
    first = replace(first, detection=replace(first.detection, cov_xy=-2e-6))
    found = decode(encode_result(make(touches=(first,)), [], 0.0))
    assert found["touches"][0][-1] == pytest.approx(-2e-6)


class Said(Reading):
    """A reading of a kind that only this test has."""

    key, listed = "weather", "weathers"
    text = word = "rain"
    facts: ClassVar = {}
    shown = ShownReading("rain", "It rains", "sheet", drawn=(0.5, 1.25))


def test_what_calibrations_read_goes_last():
    readings = {"sky": Said(), "touch": CalibrationHealth(0, 1.0)}
    found = decode(encode_result(make(5, (touch(1, [4]),), readings=readings), [], 0.0))
    assert list(found["readings"]) == ["weather"]
    told = found["readings"]["weather"]
    assert (told["words"], told["drawn"], told["notes"]) == ("rain", [0.5, 1.25], [])
    assert found["labels"] == [0, 0, 0, 0, 1]


@pytest.mark.parametrize("deformation", [FOLD, STRETCH, Deformation("unknown", None, "relative")])
def test_a_deformation_goes_with_the_readings_as_the_page_declares_it(deformation):
    readings = {"sky": Said()}
    found = decode(encode_result(make(5, readings=readings, deformation=deformation), [], 0.0))
    assert list(found["readings"]) == ["weather", "deformation"]
    told = found["readings"]["deformation"]
    assert set(told) == set(DeformationNow.__struct_fields__)
    shown = msgspec.convert(told, DeformationNow, strict=True)
    assert (shown.kind, shown.text) == (deformation.kind, deformation.text)
    assert (shown.axis is None) == (deformation.axis is None)


def test_a_probe_of_any_face_is_told_by_its_area():
    probe = Probe(Finger(), 0.5, -0.25, 3.0, angle=1.0)
    (told,) = decode(encode_result(make(), [probe], 0.0))["truth"]
    assert told == pytest.approx((0.5, -0.25, 3.0, math.sqrt(22e-3 * 16e-3) / 2))
