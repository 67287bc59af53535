"""What a skin can resolve: against an independent figure, and how it must scale."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sensing.fit.test_bound import ALONG, covariance, sheet, whitener  # type: ignore[attr-defined]
from tomoskin.core import ModelError
from tomoskin.extras.design import Demand, ResolutionBounds, resolution_bounds, variants
from tomoskin.extras.design.bounds import detection_bound, least_content
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import (
    Response,
    Whitener,
    row_covariance,
    spots_of,
)
from tomoskin.sensing.signal import Readout

PLACES = 40


PRESS = Demand(0.015)


@cache
def of(name: str, demand: Demand = PRESS, oversampling: int = 16) -> ResolutionBounds:
    skin = Skin.load(name).altered({"readout": {"oversampling": oversampling, "gain": 40}})
    return resolution_bounds(skin, demand, PLACES)


@pytest.mark.parametrize(
    ("name", "least", "most"), [("textile-disc-8", 3.6, 5.6), ("textile-disc-16", 0.6, 3.7)]
)
def test_figures_are_those_of_an_independent_model(name: str, least: float, most: float) -> None:
    """200 mm, 0.1 A, 15 mm, 25 % deep, 16 detections, 0.7 LSB; its profile is another one:
    it bounds the error by up to twice as much."""
    figures = of(name).figures()
    assert 0.4 * least < 1e3 * figures["least_m"] < least
    assert 0.4 * most < 1e3 * figures["p95_m"] < most


def test_four_times_the_readings_halve_the_error() -> None:
    few, many = of("textile-disc-8", oversampling=4), of("textile-disc-8")
    np.testing.assert_allclose(few.rms, 2 * many.rms, rtol=1e-6)
    np.testing.assert_allclose(np.log1p(-few.faintest), 2 * np.log1p(-many.faintest), rtol=1e-6)


def test_more_electrodes_help_and_a_deeper_press_is_placed_better() -> None:
    eight, sixteen = of("textile-disc-8").figures(), of("textile-disc-16").figures()
    assert sixteen["median_m"] < eight["median_m"]
    deep = of("textile-disc-8", Demand(0.015, depth=0.5)).figures()
    assert deep["median_m"] < eight["median_m"]
    assert deep["faintest_median"] == pytest.approx(eight["faintest_median"], rel=0.1)


def test_to_be_surer_takes_a_stronger_press() -> None:
    usual = of("textile-disc-8").faintest
    assert (of("textile-disc-8", Demand(0.015, false_alarm=1e-9)).faintest > usual).all()
    assert (of("textile-disc-8", Demand(0.015, detected=0.999)).faintest > usual).all()
    assert ((usual > 0) & (usual < 1)).all()


def test_a_press_so_faint_is_as_far_from_the_noise_as_was_asked() -> None:
    found = of("textile-disc-8")
    place = int(np.argmax(found.faintest))
    skin = Skin.load("textile-disc-8").altered({"readout": {"oversampling": 16, "gain": 40}})
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    noise = row_covariance(
        scan := Scan.of(skin.pattern()), Readout.of(scan, skin.readout).noise / np.sqrt(2)
    )
    spot = spots_of(found.mesh.centroids[[place]], 0.015, -1.0)
    spot[:, 3] = np.pi * 0.015**2 * np.log1p(-found.faintest[place])
    away = detection_bound(Response(model.at(skin.conductivity)), spot, Whitener.of(noise * 1.05))
    assert float(away[0]) == pytest.approx(PRESS.ratio, rel=0.05)
    assert PRESS.ratio == pytest.approx(3.719 + 1.645, abs=1e-3)


def test_progress_is_told() -> None:
    told: list[tuple[float, float]] = []
    resolution_bounds(
        Skin.load("textile-disc-8"), Demand(), PLACES, lambda *part: told.append(part)
    )
    assert told[0][0] == 0
    assert told[-1][0] == told[-1][1] > 30


def test_variants_are_on_the_same_sheet() -> None:
    skin = Skin.load("textile-square-16")
    every = {(v.electrodes, v.pattern): v for v in variants(skin, (8, 32), ("adjacent", "skip:3"))}
    eight = every[8, "adjacent"].skin
    assert eight is not None
    assert (eight.n_electrodes, eight.pattern().n_meas) == (8, 40)
    cover = sum(arc.width(skin.outline) for arc in skin.arcs)
    assert sum(arc.width(eight.outline) for arc in eight.arcs) == pytest.approx(cover)
    assert eight.outline.length == skin.outline.length
    assert eight.current == skin.current
    assert every[8, "skip:3"].skin is None
    assert "drives every pair twice" in every[8, "skip:3"].fault
    placed = skin.altered(
        {
            "electrodes": {
                "positions": [
                    ["-20 mm", "50 mm"],
                    ["20 mm", "50 mm"],
                    ["50 mm", "0 mm"],
                    ["0 mm", "-50 mm"],
                ],
                "count": None,
                "first": None,
                "order": None,
            }
        }
    )
    assert [v.skin is not None for v in variants(placed, (8,), ("adjacent",))] == [True]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"radius": -1.0}, "radius above 0"),
        ({"depth": 1.0}, "depth between"),
        ({"false_alarm": 0.0}, "false alarm between"),
        ({"detected": 1.5}, "found between"),
        ({"detected": 0.1, "false_alarm": 0.5}, "above the probability"),
    ],
)
def test_what_cannot_be_meant_is_refused(given: dict[str, float], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        Demand(**given)


def test_what_saturates_tells_nothing() -> None:
    """The same bound as of the pattern without those measurements."""
    skin = Skin.load("textile-disc-8").altered({"readout": {"gain": 53}})
    found = resolution_bounds(skin, PRESS, 8)
    excluded = found.headroom.saturated
    assert 0 < np.count_nonzero(excluded) < len(excluded) - 4
    pattern = skin.pattern()
    kept = {
        "drive": {
            "drive": pattern.drive[~excluded].tolist(),
            "measure": pattern.measure[~excluded].tolist(),
            "pattern": None,
        }
    }
    less = resolution_bounds(skin.altered(kept), PRESS, 8)
    np.testing.assert_allclose(found.rms, less.rms, rtol=1e-6)
    with pytest.raises(ModelError, match="a current of"):
        resolution_bounds(skin.altered({"readout": {"gain": 400}}), PRESS, 8)


def test_the_least_press_is_as_large_as_asked() -> None:
    spots = spots_of(ALONG[::4], 0.02, -0.01)
    faint = spots.copy()
    faint[:, 3] = least_content(sheet(), spots, whitener(), 5.0)
    assert detection_bound(sheet(), faint, whitener()) == pytest.approx(5.0, rel=0.05)


def test_half_the_noise_doubles_what_a_press_is_noticed_by() -> None:
    spots = spots_of(ALONG, 0.02, -0.4)
    half = Whitener.of(covariance() / 4)
    assert detection_bound(sheet(), spots, half) == pytest.approx(
        2 * detection_bound(sheet(), spots, whitener())
    )
