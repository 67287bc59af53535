"""``tomoskin skin alpha`` and ``tomoskin image --alpha`` on presses that a model made."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tomoskin.imaging import RULES
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import triangulate
from tomoskin.model.skin import Skin

SKIN = Skin.load("textile-disc-8")
IDLE, PRESSES = 5, 6
NOISE = 3e-5


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Idle frames, then presses whose places are known; on a mesh of its own."""
    mesh = triangulate(SKIN.outline, SKIN.arcs, 900, seed=11)
    model = ForwardModel(mesh, SKIN.pattern(), SKIN.contact_impedance, SKIN.current)
    angle = 2 * np.pi * np.arange(PRESSES) / PRESSES
    places = 0.05 * np.column_stack([np.cos(angle), np.sin(angle)])
    rows = [model.solve(SKIN.conductivity).voltages] * IDLE
    for place in places:
        near = np.linalg.norm(mesh.centroids - place, axis=1) < 0.015
        rows.append(model.solve(np.where(near, 0.7, 1.0) * SKIN.conductivity).voltages)
    values = np.array(rows) + np.random.default_rng(5).normal(0.0, NOISE, (len(rows), 40))
    pattern = SKIN.pattern()
    path = tmp_path_factory.mktemp("alpha") / "presses.npz"
    np.savez(
        path,
        voltages=values,
        drive=pattern.drive,
        measure=pattern.measure,
        xy_m=np.vstack([np.full((IDLE, 2), np.nan), places]),
    )
    return path


Command = Callable[..., tuple[int, str, str]]


def document(output: tuple[int, str, str]) -> Any:
    code, text, err = output
    assert (code, err) == (0, "")
    return json.loads(text)


@pytest.mark.slow
def test_with_a_recording_every_rule_chooses(
    tomoskin: Command, recording: Path, tmp_path: Path
) -> None:
    picture = tmp_path / "curves.png"
    found = document(
        tomoskin(
            *("skin", "alpha", "textile-disc-8", "--recording", recording),
            *("--reference", f"first:{IDLE}", "--out", picture, "--json"),
        )
    )
    assert list(found["rules"]) == list(RULES)
    for row in found["rules"].values():
        assert row["reason"]
        assert 1e-4 < row["alpha"] < 10
    assert found["condition"] > 10
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 20_000


def test_without_a_recording_the_noise_is_predicted(tomoskin: Command) -> None:
    code, text, err = tomoskin("skin", "alpha", "textile-disc-8")
    assert (code, err) == (0, "")
    lines = {line.split()[0]: line for line in text.splitlines()[2:]}
    assert list(lines) == list(RULES)
    assert float(lines["light-touch"].split()[1]) > 0.01


def test_the_picture_of_rules_without_a_recording(tomoskin: Command, tmp_path: Path) -> None:
    picture = tmp_path / "curves.png"
    assert tomoskin("skin", "alpha", "textile-disc-8", "--out", picture)[0] == 0
    assert picture.stat().st_size > 10_000


def test_a_recording_that_is_not_there(tomoskin: Command) -> None:
    code, _, err = tomoskin("skin", "alpha", "textile-disc-8", "--recording", "none.npz")
    assert code == 1
    assert "none.npz" in err


def test_a_rule_that_was_probably_meant_is_named(tomoskin: Command) -> None:
    for rule, says in (
        ("elbow", "expected a rule among light-touch"),
        ("noisefigure", '"noise-figure"?'),
    ):
        code, _, err = tomoskin("skin", "alpha", "textile-disc-8", "--rule", rule)
        assert code == 2
        assert says in " ".join(err.replace("│", " ").split())


@pytest.mark.parametrize(
    ("alpha", "rule"), [("0.08", "hand"), ("auto", "model-error"), ("noise-figure", "noise-figure")]
)
def test_image_says_alpha_and_what_chose_it(
    tomoskin: Command, recording: Path, alpha: str, rule: str
) -> None:
    arguments = ("image", recording, "--reference", f"first:{IDLE}", "--alpha", alpha)
    found = document(tomoskin(*arguments, "--json"))
    assert found["rule"] == rule
    if rule == "hand":
        assert found["alpha"] == 0.08
    assert f"alpha {found['alpha']:.4g} ({rule}: " in tomoskin(*arguments)[1]


def test_image_follows_the_noise_of_the_reference(tomoskin: Command, recording: Path) -> None:
    """Five idle frames tell the noise; one does not, and what models get wrong decides alone."""
    arguments = ("image", recording, "--alpha", "auto", "--json", "--reference")
    measured = document(tomoskin(*arguments, f"first:{IDLE}"))
    unknown = document(tomoskin(*arguments, "first:1"))
    assert measured["rule"] == unknown["rule"] == "model-error"
    assert measured["alpha"] > unknown["alpha"]
    text = tomoskin(*arguments[:-2], "--reference", "first:1")[1]
    assert "trusted to 1 % of a frame's change, as no idle frames tell its noise" in text


@pytest.mark.parametrize("alpha", ["0", "-0.1", "nan", "inf", "elbow"])
def test_an_alpha_that_cannot_be_meant(tomoskin: Command, recording: Path, alpha: str) -> None:
    code, _, err = tomoskin("image", recording, f"--alpha={alpha}")
    assert code == 2
    assert "--alpha" in err
