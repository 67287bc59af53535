"""A touch on a sheet whose pattern cannot tell two places apart has both."""

import numpy as np
import pytest

from tomoskin.files.messages.contacts import touch_row
from tomoskin.files.session.layout import touches_of
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare, reconstruct
from tomoskin.sensing.signal import Recording
from tomoskin.server import views


@pytest.fixture(scope="module")
def across():
    """Opposite electrodes driven, and read by the other opposite pairs."""
    rows = [(k, j) for k in range(4) for j in range(4) if j != k]
    table = {"drive": [[k + 4, k] for k, _ in rows], "measure": [[j, j + 4] for _, j in rows]}
    return prepare(Skin.load("textile-disc-8").altered({"drive": {"pattern": None, **table}}))


def press(prepared, x, y):
    """The touches of a press at (x, y) m after untouched frames."""
    far = np.linalg.norm(prepared.mesh.centroids - [x, y], axis=1)
    pressed = prepared.skin.conductivity * (1 - 0.3 * (far < 0.015))
    rest, touched = (
        prepared.model.solve(sigma).voltages for sigma in (prepared.skin.conductivity, pressed)
    )
    frames = np.vstack([rest] * 20 + [touched] * 4)
    frames += 1e-5 * np.abs(rest).max() * np.random.default_rng(7).standard_normal(frames.shape)
    recording = Recording(
        frames,
        prepared.pattern.drive,
        prepared.pattern.measure,
        0.1 * np.arange(len(frames)),
        reference=None,
        labels=None,
        is_change=False,
        source="frames",
    )
    return reconstruct(prepared, recording, range(20)).touches[-1]


def test_a_touch_has_the_place_across_too(across):
    (touch,) = press(across, -0.05, -0.03)
    places = [(touch.detection.x, touch.detection.y), *touch.elsewhere]
    assert len(places) == 2
    for place in ((-0.05, -0.03), (0.05, 0.03)):
        assert min(np.linalg.norm(np.subtract(place, own)) for own in places) < 0.005
    assert ", or at " in touch.said


def test_a_touch_has_one_place_where_the_pattern_tells_all(prepared):
    (touch,) = press(prepared, -0.05, -0.03)
    assert touch.elsewhere == ()
    assert touch.said == "decrease"


def test_a_session_keeps_the_places(across):
    touches = press(across, -0.05, -0.03)
    content = {"host_time": 0.0, "sequence": 1, "touches": [touch_row(t) for t in touches]}
    assert touches_of(content).touches[0].elsewhere == touches[0].elsewhere


def test_the_page_gets_the_places(across, prepared):
    scene = views.scene(across, "twin", limit=1.0, pressable=True)
    (a, b, c, d, e, f) = scene.same.maps[0]
    assert (a * 0.05 + b * 0.03 + e, c * 0.05 + d * 0.03 + f) == pytest.approx((-0.05, -0.03))
    assert "180°" in scene.same.text
    assert views.scene(prepared, "twin", limit=1.0, pressable=True).same is None
