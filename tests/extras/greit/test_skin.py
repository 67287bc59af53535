"""Skins whose images GREIT makes: prepared, followed, and what is said of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.test_foreign import prepared as prepared_for, recording, touched
from pipeline.test_unresolved import open_part
from server.test_unresolved import asked, at_one_moment
from tomoskin.core import ModelError, SkinError
from tomoskin.extras.greit import Greit
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare, reconstruct, tuned_by_rule

TRAINED = {"method": "greit", **dict.fromkeys(("prior", "alpha", "exponent", "time_constant"))}


def test_a_greit_skin_is_prepared_with_the_trained_operator() -> None:
    coarse = Skin.load("tank-16").altered({"mesh": {"cells": 600}})
    prepared = prepare(coarse)
    assert isinstance(prepared.operator, Greit)
    assert (prepared.choice.rule, prepared.light_touch) == ("greit", None)
    assert prepared.operator.noise_figure == coarse.inverse.record("method").noise_figure == 1.0
    fewer = prepared.without(np.arange(5))
    assert isinstance(fewer.operator, Greit)
    assert fewer.operator.matrix.shape[1] == prepared.operator.matrix.shape[1] - 5


def test_a_rule_cannot_choose_the_alpha_of_a_method_without_one() -> None:
    prepared = prepare(Skin.load("tank-16").altered({"mesh": {"cells": 600}}))
    with pytest.raises(ModelError, match=r'method "one-step".*"greit"'):
        tuned_by_rule(prepared, "noise-figure", None)
    with pytest.raises(SkinError, match=r"needs method"):
        prepared.skin.altered({"inverse": {"alpha": 0.1}})


def test_the_built_in_tank() -> None:
    skin = Skin.load("tank-16")
    assert (skin.name, skin.source) == ("tank-16", "built-in")
    assert "tank-16" in Skin.names()
    assert len(skin.mesh().cells) == pytest.approx(skin.mesh_cells, rel=0.1)
    assert skin.to_toml().index("noise_figure") > skin.to_toml().index('method = "greit"')


def test_its_noise_figure_is_a_key_of_its_own() -> None:
    with pytest.raises(SkinError, match='needs method = "greit"'):
        Skin.load("textile-disc-8").altered({"inverse": {"noise_figure": 2.0}})


def test_a_board_that_is_not_known_has_no_noise_to_predict() -> None:
    made = prepared_for(skin="tank-16")
    values = touched(made)
    rules = []
    for known in (False, True):
        one = replace(recording(made, values), board_known=known)
        rules.append(reconstruct(made, one, values[:1]).choice.rule)
    assert rules == ["model-error", "greit"]


def test_a_trained_operator_shows_two_objects_of_another_board_apart() -> None:
    """Their distance is that of objects in a tank of others that were one maximum."""
    made = prepare(Skin.load("tank-16"))
    ends = np.array([[-0.0425, -0.05], [0.0425, -0.05]])
    sigma = np.full(len(made.mesh.cells), made.skin.conductivity)
    far = [np.linalg.norm(made.mesh.centroids - p, axis=1) for p in (*ends, ends.mean(axis=0))]
    sigma[np.minimum(*far[:2]) < 0.02] *= 0.5
    values = np.array([made.model.solve(s).voltages for s in (made.skin.conductivity, sigma)])
    image = reconstruct(made, recording(made, values), values[:1]).images[1]
    one, other, middle = (-image[away < 0.012].mean() for away in far)
    assert middle < 0.95 * min(one, other)


def test_a_trained_operator_has_no_prior() -> None:
    prepared = prepare(Skin.load("textile-disc-8").altered({"mesh": {"cells": 600}}))
    trained = prepare(prepared.skin.altered({"inverse": TRAINED}), prepared)
    with pytest.raises(ModelError, match="a trained operator has no prior"):
        open_part(trained)


def test_why_there_is_none_is_said(prepared, tmp_path):
    told = asked(at_one_moment(prepare(prepared.skin.altered({"inverse": TRAINED}))), tmp_path)
    assert told["values"] is None
    assert "a trained operator has no prior" in told["problem"]
