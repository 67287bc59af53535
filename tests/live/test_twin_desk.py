"""Breaking and mending the twin from a page."""

from __future__ import annotations

import msgspec
import pytest

from live.test_settings import Heard
from tomoskin.core import WireError
from tomoskin.live import Hub, Runner
from tomoskin.live.requests import decode_request
from tomoskin.live.twin_desk import TwinDesk
from tomoskin.source import open_source


def asked(**fields):
    return decode_request(msgspec.json.encode({"type": "twin", "cut": [], "noise": None} | fields))


@pytest.fixture
def twin(prepared):
    transports = []

    def opener():
        transports.append(open_source("twin:fast", prepared.skin))
        return transports[-1]

    runner = Runner(prepared, opener)
    runner.start()
    while not runner.breakable:
        pass
    hub = Hub(runner, limit=1.0)
    hub.take(TwinDesk(hub))
    yield hub, transports
    runner.stop()


def test_an_electrode_is_cut_and_mended(twin):
    hub, [transport] = twin
    page = Heard()
    hub.join(page)
    own = transport.electronics.settings.noise
    hub.obey(page, asked(cut=[4], noise=20))
    assert transport.electronics.faults.cut == {4}
    assert transport.electronics.settings.noise == 20
    assert page.last("twin") == {"type": "twin", "breakable": True, "cut": [4], "noise": 20}
    hub.obey(page, asked())
    assert not transport.electronics.faults.cut
    assert transport.electronics.settings.noise == own
    hub.leave(page)


def test_an_electrode_that_is_not_there(twin):
    hub, [transport] = twin
    with pytest.raises(WireError, match="expected electrodes from 0 to 7, got 8"):
        hub.obey(Heard(), asked(cut=[8]))
    assert not transport.electronics.faults.cut


def test_a_board_is_not_broken(runner):
    runner.start()
    hub = Hub(runner, limit=1.0)
    hub.take(TwinDesk(hub))
    with pytest.raises(WireError, match="cannot be broken"):
        hub.obey(Heard(), asked(cut=[1]))


@pytest.mark.parametrize("fields", [{"cut": [-1]}, {"cut": [32]}, {"noise": -1}, {"rail": [1]}])
def test_what_cannot_be_meant(fields):
    with pytest.raises(WireError):
        asked(**fields)
