"""One small skin and its twin for every test of the room."""

import pytest

from tomoskin.model.skin import Skin
from tomoskin.twin import TwinSettings, TwinSkin


@pytest.fixture(scope="session")
def skin():
    return Skin.load("textile-disc-8").altered({"mesh": {"cells": 300}})


@pytest.fixture(scope="session")
def _made(skin):
    return TwinSkin.of(skin, TwinSettings())


@pytest.fixture
def sheet(_made):
    _made.set_presses(())
    yield _made
    _made.set_presses(())
