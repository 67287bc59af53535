"""What people see: the averaging filter, the unit and the colour scale."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shapes import box, disc
from tomoskin.core import DataError, Detection, FloatArray, Image, Touch
from tomoskin.files.exports import Display, Panel, plot, write_picture
from tomoskin.files.exports.picture import circular_average
from tomoskin.model.mesh import Mesh


@cache
def mesh() -> Mesh:
    return disc(8, 400)


def image(values: FloatArray) -> Image:
    return Image(values, "S", mesh().identity)


def test_the_average_is_that_over_the_disc_by_area() -> None:
    """Against a loop over the cells."""
    values = np.random.default_rng(0).standard_normal(len(mesh().cells))
    found = circular_average(mesh(), 0.012) @ values
    for cell in range(0, len(values), 17):
        away = np.linalg.norm(mesh().centroids - mesh().centroids[cell], axis=1)
        near = away <= 0.012
        expected = np.average(values[near], weights=mesh().volumes[near])
        assert found[cell] == pytest.approx(expected)


def test_an_even_image_stays_and_steps_shrink() -> None:
    average = circular_average(mesh(), 0.015)
    assert average @ np.ones(len(mesh().cells)) == pytest.approx(np.ones(len(mesh().cells)))
    noise = np.random.default_rng(1).standard_normal(len(mesh().cells))
    first, second = mesh().neighbours.T
    steps = [np.abs(x[first] - x[second]).mean() for x in (noise, average @ noise)]
    assert steps[1] < 0.3 * steps[0]


def test_a_radius_below_the_cells_changes_nothing() -> None:
    values = np.arange(len(mesh().cells), dtype=float)
    assert circular_average(mesh(), 1e-6) @ values == pytest.approx(values)


def test_shown_in_parts_of_the_sheets_own() -> None:
    values = np.linspace(-0.1, 0.1, len(mesh().cells))
    seen = Display(conductivity=2.0).shown(image(values), mesh())
    assert seen.unit == "relative"
    assert seen.values == pytest.approx(values / 2.0)
    again = Display(conductivity=2.0).shown(seen, mesh())
    assert np.array_equal(again.values, seen.values)
    assert Display().shown(image(values), mesh()).unit == "S"


def test_a_stack_of_images_is_filtered_as_each() -> None:
    stack = np.random.default_rng(2).standard_normal((3, len(mesh().cells)))
    display = Display(conductivity=0.5, smoothing=0.01)
    together, unit = display.applied(stack, mesh(), "S")
    each = [display.shown(image(values), mesh()).values for values in stack]
    assert unit == "relative"
    assert together == pytest.approx(np.array(each))


def test_a_fixed_scale_is_kept_and_what_is_beyond_it_is_marked() -> None:
    pytest.importorskip("matplotlib")
    values = np.zeros(len(mesh().cells))
    values[5] = -0.04
    figure = plot(image(values), mesh(), display=Display(conductivity=1.0, limit=0.01))
    drawn: Any = figure.axes[0].collections[0]
    assert drawn.get_clim() == pytest.approx((-1.0, 1.0))
    assert drawn.get_array().min() == pytest.approx(-4.0)
    assert "(%)" in figure.axes[1].get_ylabel()
    assert drawn.colorbar.extend == "both"
    free = plot(image(values), mesh())
    assert free.axes[0].collections[0].get_clim() == pytest.approx((-0.04, 0.04))
    assert "(S)" in free.axes[1].get_ylabel()


def test_no_change_is_drawn_too() -> None:
    pytest.importorskip("matplotlib")
    figure = plot(image(np.zeros(len(mesh().cells))), mesh(), title="nothing")
    assert figure.axes[0].get_title() == "nothing"


def test_a_plot_goes_on_axes_that_are_given_with_electrodes_touches_and_a_bar() -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    plt.switch_backend("agg")
    figure, (left, right) = plt.subplots(1, 2)
    detection = Detection(0.02, -0.03, 1e-3, 1e-3, 1e-4, -0.1, np.empty(0))
    touch = Touch(1, "decrease", 0.0, detection)
    drawn = plot(image(np.ones(len(mesh().cells))), mesh(), touches=[touch], ax=right)
    plt.close(figure)
    assert drawn is figure
    assert not left.collections
    texts = {text.get_text() for text in right.texts}
    assert {f"E{n}" for n in range(1, len(mesh().electrodes) + 1)} | {"20, -30"} == texts
    assert figure.axes[-1].get_ylabel() == "change of conductivity (S)"


def test_a_volume_is_refused() -> None:
    line = np.linspace(0, 1, 3)
    body = box(line, line, line)
    with pytest.raises(DataError, match="volume cannot be drawn"):
        plot(Image(np.zeros(len(body.cells)), "S/m", body.identity), body)


def test_an_image_of_another_mesh_is_refused() -> None:
    with pytest.raises(DataError, match="belongs to mesh"):
        plot(Image(np.zeros(len(mesh().cells)), "S", "other"), mesh())


def test_without_matplotlib(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    panel = Panel("", np.zeros(len(mesh().cells)), ())
    with pytest.raises(DataError, match="needs the package matplotlib"):
        write_picture(tmp_path / "x.png", mesh(), [panel], "S")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"conductivity": 0.0}, "conductivity above 0, got 0.0"),
        ({"limit": -1.0}, "limit above 0, got -1.0"),
        ({"limit": np.nan}, "limit above 0"),
        ({"smoothing": -0.01}, "radius of 0 m or more"),
        ({"smoothing": np.inf}, "radius of 0 m or more"),
    ],
)
def test_impossible_settings(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(DataError, match=message):
        Display(**settings)


@pytest.mark.parametrize("radius", [0.0, -1.0, 0.06, np.nan])
def test_an_impossible_radius(radius: float) -> None:
    with pytest.raises(DataError, match="circular average: expected a radius"):
        circular_average(mesh(), radius)
