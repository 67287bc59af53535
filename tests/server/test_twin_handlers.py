"""Breaking and mending the twin from a page."""

from __future__ import annotations

import asyncio

import msgspec
import pytest

from run.test_runner import Watch
from server.test_settings import Heard
from tomoskin.board.source import open_source
from tomoskin.core import GeometryError, WireError
from tomoskin.files.session import SessionReader
from tomoskin.model.mesh import Arm, Cap, Hinge
from tomoskin.run import Runner, commands
from tomoskin.run.commands import BendRequest, SetPose, StretchRequest
from tomoskin.run.twin_control import sheet_pose, way_to_bend
from tomoskin.server import Hub
from tomoskin.server.handlers import TwinHandlers
from tomoskin.server.requests import decode_request
from tomoskin.twin import FACES, Bent, Face, Press, Probe, Square, Stretched

BEND = {"angle": 0.8, "axis": 0.5, "length": 0.06}
STRETCH = {"along": 0.05, "across": -0.02, "axis": 0.3}
CORNERS = [[0, 0.015], [-0.013, -0.0075], [0.013, -0.0075]]
PRESS = {"x": 0.02, "y": 0.01, "force": 3.0, "radius": 0.012}


def posing(**fields):
    return decode_request(msgspec.json.encode({"type": "pose"} | fields))


def pressing(**fields):
    return decode_request(msgspec.json.encode({"type": "presses", "presses": [PRESS | fields]}))


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
    Watch(runner).until(lambda: runner.flow.twin.breakable)
    hub = Hub(runner)
    TwinHandlers(hub)
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
    told = page.last("twin")
    assert (told["breakable"], told["cut"], told["noise"]) == (True, [4], 20)
    hub.obey(page, asked())
    assert not transport.electronics.faults.cut
    assert transport.electronics.settings.noise == own
    hub.leave(page)


def test_an_electrode_that_is_not_there(twin):
    hub, [transport] = twin
    with pytest.raises(WireError, match=r"expected electrodes from 0 \(E1\) to 7, got 8"):
        hub.obey(Heard(), asked(cut=[8]))
    assert not transport.electronics.faults.cut


def test_a_board_is_not_broken(runner):
    runner.start()
    hub = Hub(runner)
    TwinHandlers(hub)
    with pytest.raises(WireError, match="cannot simulate faults"):
        hub.obey(Heard(), asked(cut=[1]))


@pytest.mark.parametrize("fields", [{"cut": [-1]}, {"cut": [32]}, {"noise": -1}, {"rail": [1]}])
def test_what_cannot_be_meant(fields):
    with pytest.raises(WireError):
        asked(**fields)


# bends


def posed(hub, page, *requests):
    """Ask for poses one after the other, and wait for as many answers."""

    async def ask():
        async with hub.running():
            hub.join(page)
            page.told.clear()
            for request in requests:
                hub.obey(page, request)
            await page.until(lambda: sum(m["type"] == "twin" for m in page.told) == len(requests))
            hub.leave(page)

    asyncio.run(ask())


def test_the_sheet_is_bent_and_stretched_and_laid_flat(twin):
    hub, [transport] = twin
    page = Heard()
    posed(hub, page, posing(bend=BEND, stretch=STRETCH))
    bend, stretch = transport.sheet.pose
    assert bend == Bent(Hinge(0.8, 0.06, 0.5, 0.0))
    assert stretch == Stretched(0.05, -0.02, 0.3)
    told = page.last("twin")
    assert (told["bendable"], told["bends"]) == (True, "hinge")
    assert told["bend"] == BEND | {"offset": 0.0}
    assert told["stretch"] == STRETCH
    assert told["size_m"] == pytest.approx(0.2, rel=0.01)
    posed(hub, page, posing())
    assert transport.sheet.pose == ()
    assert page.last("twin")["bend"] is None


def test_of_many_bends_the_newest_is_taken_and_each_is_answered(twin):
    hub, [transport] = twin
    page = Heard()
    angles = [0.1, 0.2, 0.3, 0.4]
    posed(hub, page, *(posing(bend=BEND | {"angle": angle}) for angle in angles))
    assert transport.sheet.pose == (Bent(Hinge(0.4, 0.06, 0.5, 0.0)),)


def test_a_shape_that_it_cannot_take_is_refused_in_words(twin):
    hub, [transport] = twin
    page = Heard()
    posed(hub, page, posing(bend=BEND))
    stood = transport.sheet.pose
    posed(hub, page, posing(bend={"angle": -6.2, "length": 0.01}))
    assert "expected at most 180°" in page.last("twin_refused")["message"]
    assert transport.sheet.pose == stood
    assert page.last("twin")["bend"] == BEND | {"offset": 0.0}


def test_the_truth_of_a_recording_knows_bends_and_faces(twin, tmp_path):
    hub, [transport] = twin
    runner, page = hub.runner, Heard()
    until = Watch(runner).until
    until(lambda: runner.newest is not None)
    runner.ask(commands.Record(tmp_path / "bent.mcap"))
    posed(hub, page, posing(bend=BEND))
    hub.obey(page, pressing(shape="polygon", vertices=CORNERS, angle=1.0))
    until(lambda: bool(runner.newest.truth))
    assert transport.sheet.presses == runner.newest.truth
    runner.ask(commands.StopRecording())
    with SessionReader(tmp_path / "bent.mcap") as session:
        last = list(session.truth())[-1]
    assert last.bends == ({"kind": "hinge", "angle": 0.8, "axis": 0.5},)
    (press,) = last.presses
    assert (press["shape"], press["angle"], press["x"]) == ("face", 1.0, 0.02)


def test_a_sheet_on_a_limb_bends_at_its_joint():
    surface = Arm(0.03, 0.2, 0.1)
    made = sheet_pose(SetPose(BendRequest(0.5), None), surface)
    assert made.pose == (Bent(Arm(0.03, 0.7, 0.1)),)
    assert made.truth == ({"kind": "joint", "angle": 0.5, "axis": 0.0},)
    with pytest.raises(GeometryError, match="folds"):
        sheet_pose(SetPose(BendRequest(6.0), None), surface)
    cap = Cap(0.2)
    assert way_to_bend(cap) is None
    with pytest.raises(WireError, match="can be stretched"):
        sheet_pose(SetPose(BendRequest(0.5), None), cap)
    assert sheet_pose(SetPose(None, StretchRequest(0.1)), cap).pose == (Stretched(0.1),)


def test_a_board_is_not_bent(runner):
    runner.start()
    hub = Hub(runner)
    TwinHandlers(hub)
    with pytest.raises(WireError, match="cannot be bent"):
        hub.obey(Heard(), posing(bend=BEND))


# faces


@pytest.mark.parametrize(
    ("fields", "face"),
    [
        ({"shape": "square"}, Square(0.024)),
        ({"shape": "finger"}, FACES["finger"](0.012)),
        ({"shape": "polygon", "vertices": CORNERS}, Face(tuple(map(tuple, CORNERS)))),
    ],
)
def test_presses_have_faces(fields, face):
    (press,) = pressing(**fields, angle=0.5).presses
    assert press.contact == Probe(face, 0.02, 0.01, 3.0, 0.5)


def test_a_circle_is_a_press():
    (press,) = pressing().presses
    assert press.contact == Press(0.02, 0.01, 3.0, 0.012)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"shape": "polygon"}, "expected vertices for a polygon"),
        ({"vertices": CORNERS}, "expected vertices for a polygon"),
        ({"shape": "polygon", "vertices": CORNERS[:2]}, "vertices"),
        ({"shape": "polygon", "vertices": [[0, 0], [1e-2, 1e-2], [1e-2, 0], [0, 1e-2]]}, "cross"),
        ({"shape": "polygon", "vertices": [[0, 0], [0.05, 0.031], [0.05, 0.0311]]}, "narrower"),
    ],
)
def test_faces_that_cannot_press(twin, fields, says):
    hub, [transport] = twin
    with pytest.raises(WireError, match=says):
        hub.obey(Heard(), pressing(**fields))
    assert transport.sheet.presses == ()


@pytest.mark.parametrize(
    "fields",
    [
        {"bend": {}},
        {"bend": BEND | {"angle": 7}},
        {"bend": BEND | {"length": 0}},
        {"stretch": {"along": 2}},
        {"twist": 1},
    ],
)
def test_poses_that_cannot_be_meant(fields):
    with pytest.raises(WireError):
        posing(**fields)
