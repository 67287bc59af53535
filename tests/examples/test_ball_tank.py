"""Balls in a tank of salt water: how deep it is, where they are, what stays without them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

pytest.importorskip("tomoskin.extras.absolute", reason="it uses an extra that is not here")


@pytest.fixture
def example(imported):
    return imported("ball_tank")


@pytest.mark.slow
def test_the_depth_is_that_of_the_tank_that_was_measured(example, monkeypatch):
    monkeypatch.setattr(example, "DEPTHS", np.array([0.18, 0.22, 0.26]))
    empty = 7.0 * example.tank(0.215, 300, 6).solve(1.0).voltages
    assert example.depth_of(empty) == pytest.approx(0.215, abs=0.015)


def test_the_reference_is_what_is_left_without_the_balls(example):
    """The mean of the frames still holds the ball; what the rounds make of it hardly."""
    rng = np.random.default_rng(0)
    shapes, empty = rng.normal(0.0, 0.05, (4, 208)), rng.uniform(1.0, 2.0, 208)
    units = shapes / np.linalg.norm(shapes, axis=1)[:, None]

    def finder(change):
        along = units @ change
        best = int(along.argmax())
        return example.Found(np.array([best, 0]), 1.0, along[best] * units[best])

    at = rng.integers(4, size=40)
    changes, balls = example.carried(finder, empty * (1.0 + shapes[at]))
    assert [int(ball.place[0]) for ball in balls] == at.tolist()
    left = np.abs((1.0 + shapes[at]) / (1.0 + changes) - 1.0).max()
    assert left < 0.5 * np.abs(shapes.mean(axis=0)).max()


@pytest.mark.data
def test_the_balls_are_found_in_some_frames_too(
    example, published, data_dir: Path, tmp_path, monkeypatch
):
    short = {"DEPTHS": np.array([0.2, 0.225, 0.25]), "EVERY": 15, "SHOWN": slice(0, 3)}
    for knob, value in short.items():
        monkeypatch.setattr(example, knob, value)
    folder = data_dir / "eidors_tanks16"
    found = example.main(["--data", str(folder), "--out", str(tmp_path)])
    assert found.keys() == published["ball_tank"].values.keys()


@pytest.mark.slow
@pytest.mark.data
def test_the_film_is_made_and_the_numbers_hold(example, published, data_dir: Path, tmp_path):
    folder = data_dir / "eidors_tanks16"
    found = example.main(["--data", str(folder), "--out", str(tmp_path)])
    assert published["ball_tank"].broken(found) == []
    with Image.open(tmp_path / "ball_tank.png") as film:
        assert len(list(ImageSequence.Iterator(film))) == 40


@pytest.mark.slow
def test_a_simulated_ball_is_found(example):
    depth, place = 0.22, (0.03, -0.06)
    model = example.tank(depth, 700, 10)
    inside = example._ball(model.mesh.centroids, (*place, depth / 2))
    empty, ball = (model.solve(1.0 - 0.98 * part).voltages for part in (0.0 * inside, inside))
    finder = example.Finder(depth)
    found = finder(ball / empty - 1.0)
    assert np.linalg.norm(found.place - place) < 5e-3
    assert found.explained > 0.95
    picture = finder.picture(ball / empty - 1.0)
    assert np.linalg.norm(finder.mesh.centroids[picture.argmin()] - place) < 0.02
