"""The page of a whole robot: its skins in space, and each one's own page below it."""

from __future__ import annotations

import json
import re
import threading
from contextlib import closing

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from extras.robot.test_robot_run import Watch
from server.serving import PATIENCE, Site
from server.watching import Watched
from tomoskin.core import SkinError, WallClock
from tomoskin.extras.robot import Member, Robot, RobotRun
from tomoskin.extras.robot.overview import Overview, Stance, robot_application
from tomoskin.files.session import split_targets
from tomoskin.run import Runner
from tomoskin.server import Hub, Server, listen, serve_requests
from tomoskin.server.access import AccessPolicy
from tomoskin.server.server import STATIC
from tomoskin.twin import Press, TwinSettings, make_twin

ROBOT = """format = 1
[robot]
name = "an arm"
urdf = "arm.urdf"
[[skin]]
name = "left"
skin = "textile-disc-8"
link = "fore"
position = ["0 mm", "0 mm", "50 mm"]
[[skin]]
name = "right"
skin = "textile-disc-8"
link = "fore"
position = ["0 mm", "0 mm", "-50 mm"]
angles = ["180 deg", "0 deg", "0 deg"]
"""
URDF = """<robot name="arm"><link name="base"/><link name="fore">
<visual><geometry><sphere radius="0.04"/></geometry></visual>
<visual><geometry><mesh filename="package://arm/fore.wrl"/></geometry></visual>
</link><joint name="elbow"
type="revolute"><parent link="base"/><child link="fore"/>
<origin xyz="0.3 0 0.1"/></joint></robot>"""
PLACE = (0.03, -0.02)


class RobotSite(Site):
    """A robot's server, as tests meet that of one skin."""

    def __init__(self, folder, robot, run):
        self._listener = listen("127.0.0.1", 0)
        self.port = self._listener.getsockname()[1]
        self.policy = AccessPolicy(self.port)
        self.origin = f"http://127.0.0.1:{self.port}"
        hubs = {}
        for name, runner in run.runners.items():
            hubs[name] = Hub(runner, folder)
            serve_requests(hubs[name], "twin")
        app = robot_application(Overview(robot, run, folder), hubs, self.policy, STATIC)
        self._server = Server.of(app)
        self._thread = threading.Thread(target=self._server.run_on, args=(self._listener,))
        self._thread.start()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robot")
    (folder / "arm.urdf").write_text(URDF)
    (folder / "robot.toml").write_text(ROBOT)
    return folder


@pytest.fixture(scope="module")
def twins(prepared):
    return {
        name: make_twin(prepared.skin, TwinSettings.preset("textile", seed), WallClock())
        for seed, name in enumerate(("left", "right"))
    }


@pytest.fixture(scope="module")
def run(folder, prepared, twins):
    robot = Robot.load(folder / "robot.toml")
    run = RobotRun([Member(s.place, prepared, lambda s=s: twins[s.name]) for s in robot.skins])
    run.start()
    Watch(run).until(lambda: all(s.reference.ready for s in run.statuses().values()))
    yield run
    run.stop()


@pytest.fixture(scope="module")
def site(folder, run):
    site = RobotSite(folder, Robot.load(folder / "robot.toml"), run)
    yield site
    site.stop()


@pytest.fixture
def pressed(run, twins):
    """A press on the skin that looks down."""
    twins["right"].set_presses((Press(*PLACE, force=5.0, radius=0.015),))
    Watch(run).until(lambda: run.runners["right"].newest.result.touches)
    yield
    twins["right"].set_presses(())
    Watch(run).until(lambda: not run.runners["right"].newest.result.touches)


def test_touches_are_told_in_the_frame_of_the_robot(site, pressed):
    del pressed
    with site.connect() as page:
        scene = json.loads(page.recv(PATIENCE))
        assert [skin["frame"] for skin in scene["skins"]] == ["fore", "fore"]
        assert scene["bones"] == [0, 1]
        assert scene["poses"] == [
            1,
            0,
            0,
            0,
            0,
            1,
            0,
            0,
            0,
            0,
            1,
            0,
            1,
            0,
            0,
            0.3,
            0,
            1,
            0,
            0,
            0,
            0,
            1,
            0.1,
        ]
        (link,) = scene["links"]
        assert link["link"] == 1
        corners = np.array(link["corners"]).reshape(-1, 3)
        assert corners.min(axis=0) == pytest.approx([-0.04, -0.04, -0.04], abs=1e-4)
        assert corners.max(axis=0) == pytest.approx([0.04, 0.04, 0.04], abs=1e-4)
        (undrawn,) = scene["undrawn"]
        assert undrawn.startswith("fore: package://arm/fore.wrl: expected a file ending in")
        middle = np.array(scene["skins"][1]["corners"]).reshape(-1, 3).mean(axis=0)
        assert scene["skins"][1]["link"] == 1
        assert middle == pytest.approx([0, 0, -0.05], abs=0.005)
        state = json.loads(page.recv(PATIENCE))
        assert state["skins"]["left"]["problem"] is None
        while not isinstance(told := page.recv(PATIENCE), bytes):
            pass
        skins = json.loads(told)["skins"]
        assert json.loads(told)["poses"] == scene["poses"]
        assert "no joint states are given" in skins["right"]["pose_problem"]
    assert skins["left"]["touches"] == []
    (touch,) = skins["right"]["touches"]
    x, y = PLACE
    assert touch["position"] == pytest.approx([0.3 + x, -y, 0.05], abs=0.015)
    assert touch["normal"] == pytest.approx([0, 0, -1], abs=1e-5)


def test_of_a_board_that_is_lost_no_touch_is_shown(site, pressed, monkeypatch):
    """The last ones may be over."""
    del pressed
    now = Runner.contacts.fget
    gone = property(lambda runner: now(runner).outdated("the port is gone"))
    monkeypatch.setattr(Runner, "contacts", gone)
    with site.connect() as page:
        while not isinstance(told := page.recv(PATIENCE), bytes):
            pass
    shown = json.loads(told)["skins"]["right"]
    assert (shown["valid"], shown["touches"]) == (False, [])


def test_links_are_drawn_as_their_joints_stand_else_as_they_stood_last(folder):
    states = {1.0: {"elbow": 0.0}, 2.0: {"elbow": np.pi / 2}}

    def joints(utc):
        def position(name):
            if utc not in states:
                raise SkinError("pose unknown")
            return states[utc][name]

        return position

    stance = Stance(Robot.load(folder / "robot.toml").moved_by(joints))
    for utc, rotation in ((0.0, 0.0), (2.0, np.pi / 2), (3.0, np.pi / 2), (1.0, 0.0)):
        pose = stance.poses(utc)["fore"]
        assert pose.position == pytest.approx([0.3, 0, 0.1])
        turned = Rotation.from_rotvec([rotation, 0, 0]).as_matrix()  # a URDF's own axis is x
        assert pose.rotation == pytest.approx(turned)


def test_below_it_each_skin_has_its_own_page(site):
    with site.client() as client:
        assert client.get("/skin/left/").status_code == 200
        assert "robot" in client.get("/").text
        assert client.get("/status").json()["skins"].keys() == {"left", "right"}
        assert client.get("/skin/right/status").json()["running"]
        assert client.get("/skin/leg/").status_code == 404
    with site.client(entered=False) as client:
        assert client.get("/skin/left/").status_code == 403


def test_all_are_recorded_to_one_file_from_the_page(site, run, folder):
    with site.connect() as page:
        page.send(json.dumps({"type": "record", "on": True}))
        Watch(run).until(lambda: run.recording is not None)
        path = run.recording
        page.send(json.dumps({"type": "record", "on": False}))
        Watch(run).until(lambda: run.recording is None)
        page.send(json.dumps({"type": "pause", "on": True}))
        while "one skin" not in str(page.recv(PATIENCE)):
            pass
    assert path.parent == folder
    assert tuple(split_targets(path)) == ("left", "right")


@pytest.mark.page
@pytest.mark.usefixtures("built_page")
def test_in_a_browser_the_touch_is_on_its_skin(browser, site, prepared, pressed):
    del pressed
    watched = Watched(browser, site, prepared.mesh)
    with closing(watched.context):
        watched.page.goto(site.policy.address)
        watched.test_id("touches-left").filter(has_text="no touch").wait_for()
        watched.test_id("touches-right").filter(has_text=re.compile(r"^touch \d")).wait_for()
        watched.page.get_by_text("Not drawn: fore").wait_for()
        watched.test_id("robot-line").filter(has_text="All skins are well").wait_for()
        watched.test_id("space").press("ArrowLeft")
        watched.page.get_by_role("link", name="right").click()
        watched.until("last?.touches.length === 1")
        assert watched.page.url.endswith("/skin/right/")
        watched.test_id("robot").filter(has_text="right").click()
        watched.test_id("robot-line").wait_for()
        assert watched.wrong == []
