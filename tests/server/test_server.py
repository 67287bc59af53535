"""The server as a page, a slow page, several pages and an attacker meet it."""

import gc
import json
import mimetypes
import os
import signal
import socket
import time
import warnings
from contextlib import ExitStack, contextmanager

import pytest
from websockets.exceptions import ConnectionClosed, InvalidState, InvalidStatus

from run.board import Board, pressed, samples_of
from run.test_runner import Watch
from server.serving import PATIENCE, Site
from server.test_frames import decode
from tomoskin.files.session import session_info
from tomoskin.run import Runner
from tomoskin.server import (
    AccessPolicy,
    Hub,
    Server,
    application,
    check_page,
    listen,
    page_connection,
)
from tomoskin.server.server import ServerError


@pytest.fixture
def static(tmp_path):
    (tmp_path / "assets").mkdir()
    (tmp_path / "index.html").write_text("<title>tomoskin</title>")
    (tmp_path / "assets" / "main.js").write_text("//")
    return tmp_path


@pytest.fixture
def site(runner, static):
    runner.start()
    site = Site(runner, static)
    yield site
    site.stop()


def test_the_typeface_has_its_own_type_on_a_machine_that_knows_none(runner, static, monkeypatch):
    monkeypatch.setattr(mimetypes, "_db", mimetypes.MimeTypes())
    monkeypatch.setattr(mimetypes, "types_map", {})
    (static / "assets" / "letters.woff2").write_bytes(b"wOF2")
    site = Site(runner, static)
    try:
        with site.client() as client:
            answer = client.get("/assets/letters.woff2")
    finally:
        site.stop()
    assert answer.headers["content-type"] == "font/woff2"
    assert "default-src 'self'" in answer.headers["content-security-policy"]


def first(socket, wanted):
    """First text message of a type, or the first frame for which ``wanted`` holds."""
    end = time.monotonic() + 3 * PATIENCE
    while time.monotonic() < end:
        message = socket.recv(PATIENCE)
        if isinstance(message, str):
            found = json.loads(message)
            if found["type"] == wanted:
                return found
        elif callable(wanted) and wanted(decode(message)):
            return decode(message)
    raise AssertionError(f"nothing came that is {wanted}")


def ask(socket, **request):
    socket.send(json.dumps(request))


def ready(frame):
    return frame["flags"] & 1


# entry


def test_the_token_becomes_a_cookie_and_opens_the_page(site):
    with site.client(entered=False) as client:
        answer = client.get("/", params={"token": site.policy.token})
        assert answer.status_code == 303
        assert answer.headers["location"] == "/"
        cookie = answer.headers["set-cookie"]
        assert "HttpOnly" in cookie
        assert "SameSite=Strict" in cookie
        answer = client.get("/")
        assert answer.status_code == 200
        assert "tomoskin" in answer.text
        assert client.get("/assets/main.js").status_code == 200
        assert client.get("/favicon.ico").status_code == 204


def test_without_the_token_there_is_a_sentence_and_nothing_else(site):
    with site.client(entered=False) as client:
        for path in ("/", "/?token=", "/?token=wrong", "/assets/main.js", "/ws", "/none"):
            answer = client.get(path)
            assert answer.status_code == 403
            assert answer.text == "Open the address that tomoskin printed.\n"
            assert "set-cookie" not in answer.headers
        wrong = {"Cookie": f"tomoskin-{site.port}=wrong"}
        assert client.get("/", headers=wrong).status_code == 403


def test_every_answer_carries_the_policy(site):
    with site.client() as client:
        for path in ("/", "/assets/main.js", "/none", "/?token=wrong"):
            headers = client.get(path).headers
            assert "default-src 'self'" in headers["content-security-policy"]
            assert headers["x-content-type-options"] == "nosniff"
            assert headers["referrer-policy"] == "no-referrer"
            assert "server" not in headers


def test_a_rebound_name_is_refused_even_with_the_cookie(site):
    with site.client() as client:
        for host in ("evil.example", f"evil.example:{site.port}", "127.0.0.1:1"):
            answer = client.get("/", headers={"Host": host})
            assert answer.status_code == 403
            assert "tomoskin</title>" not in answer.text
            assert "evil" not in answer.headers["content-security-policy"]


def test_only_reading(site):
    with site.client() as client:
        for method in ("POST", "PUT", "DELETE", "OPTIONS"):
            assert client.request(method, "/").status_code == 405


@pytest.mark.parametrize(
    "path",
    [
        "/../security.py",
        "/%2e%2e/security.py",
        "/assets/..%2f..%2f..%2fsecurity.py",
        "//etc/passwd",
    ],
)
def test_no_path_leaves_the_page(site, path):
    with site.client() as client:
        request = client.build_request("GET", "/")
        request.url = request.url.copy_with(raw_path=path.encode())
        assert client.send(request).status_code == 404


@pytest.mark.parametrize(
    "wrong",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://localhost:1"},
        {"token": "wrong"},
        {"token": ""},
        {"host": "evil.example"},
        {"host": "evil.example", "origin": "http://evil.example"},
    ],
)
def test_a_websocket_of_another_site_is_refused(site, wrong):
    with pytest.raises(InvalidStatus) as refused, site.connect(**wrong):
        pass
    assert refused.value.response.status_code == 403


def test_a_cross_site_websocket_is_refused_even_with_the_cookie(site):
    cookie = site.policy.set_cookie().partition(";")[0]
    wrong = site.connect(token="", cookie=cookie, origin="http://evil.example")
    with pytest.raises(InvalidStatus), wrong:
        pass
    with site.connect(token="", cookie=cookie) as page:
        assert first(page, "scene")


def test_a_program_without_origin_needs_the_token(site):
    with site.connect(origin=None) as program:
        assert first(program, "scene")
    with pytest.raises(InvalidStatus), site.connect(origin=None, token="wrong"):
        pass


# messages


def test_a_page_gets_scene_state_and_frames(site):
    with site.connect() as page:
        scene = json.loads(page.recv(PATIENCE))
        assert scene["type"] == "scene"
        assert scene["source"] == "board on the table of textile-disc-8"
        assert scene["pressable"]
        state = first(page, "state")
        assert state["reference"]["needed"] == 20
        frame = first(page, ready)
        assert frame["n_cells"] == len(scene["cells"]) // 3
        assert frame["n_meas"] == scene["pattern"]["n_meas"]
        assert len(frame["touches"]) == 0
        assert first(page, "state")["running"]


def test_a_touch_is_seen_on_the_page(site, board, prepared):
    with site.connect() as page:
        first(page, ready)
        board.free = samples_of(prepared, pressed(prepared, -0.02, 0.03))
        frame = first(page, lambda frame: frame["n_touches"])
        _, kind, x, y = frame["touches"][0][:4]
        assert kind == 0
        assert abs(x + 0.02) < 0.01
        assert abs(y - 0.03) < 0.01
        assert set(frame["labels"]) == {0, 1}


@pytest.mark.parametrize(
    "text",
    ["", "{", "null", '{"type":"shutdown"}', '{"type":"pause","on":3}', "x" * 5000, "[" * 4000],
)
def test_a_malformed_message_is_an_error_and_the_connection_lives(site, text):
    with site.connect() as page:
        page.send(text)
        assert first(page, "error")["message"]
        ask(page, type="reference")
        assert first(page, "state")


def test_a_binary_message_is_an_error_and_the_connection_lives(site):
    with site.connect() as page:
        page.send(b"\x00\x01")
        assert "binary" in first(page, "error")["message"]
        assert first(page, "state")


def test_an_endless_message_ends_that_connection_only(site):
    with site.connect() as other, site.connect() as page:
        page.send("x" * 1_000_000)
        with pytest.raises(ConnectionClosed):
            first(page, "never")
        assert first(other, "state")


def test_reference_and_pause(site):
    with site.connect() as page:
        first(page, ready)
        ask(page, type="reference")
        first(page, lambda frame: not ready(frame))
        first(page, ready)
        ask(page, type="pause", on=True)
        while not (state := first(page, "state"))["paused"]:
            pass
        assert "paused" in state["text"]
        ask(page, type="pause", on=False)
        while first(page, "state")["paused"]:
            pass


def test_presses_reach_the_twin_and_are_lifted_when_the_page_leaves(site, board):
    held = {"x": 0.01, "y": 0.02, "force": 3.0, "radius": 0.015}
    with site.connect() as watcher:
        with site.connect() as page:
            ask(page, type="presses", presses=[held])
            truth = first(watcher, lambda frame: frame["n_truth"])["truth"]
            assert truth == [pytest.approx((0.01, 0.02, 3.0, 0.015))]
        first(watcher, lambda frame: not frame["n_truth"])
        assert board.presses == ()


def test_a_press_beside_the_sheet_presses_nothing(site):
    held = {"x": 0.01, "y": 0.02, "force": 3.0, "radius": 0.015}
    with site.connect() as page:
        ask(page, type="presses", presses=[held | {"x": 0.2}, held])
        assert first(page, lambda frame: frame["n_truth"])["n_truth"] == 1


def test_a_lost_source_is_said_on_the_page(site, board):
    with site.connect() as page:
        first(page, ready)
        board.lose()
        assert first(page, "event")
        assert board.sought.acquire(timeout=PATIENCE)
        while not (problem := first(page, "state")["problem"]):
            pass
        assert "disconnected" in problem


def test_what_happened_before_is_told_to_a_new_page(site):
    with site.connect() as page:
        first(page, ready)
        first(page, "state")
    with site.connect() as page:
        assert first(page, "event")["kind"] == "connected"


def test_the_source_goes_on_when_a_page_closes_as_the_server_stops(site, runner):
    class Closing:
        """A connection, and its transport, that a page has just closed."""

        aborted = False
        transport = property(lambda self: self)

        def shutdown(self):
            raise InvalidState("connection is closing")

        def abort(self):
            self.aborted = True

    closing = Closing()
    with site.connect() as page:
        first(page, ready)
        site._server.server_state.connections.add(closing)
        site.stop()
    assert closing.aborted
    frames = runner.status().frames
    Watch(runner).until(lambda: runner.status().frames > frames + 5)
    assert runner.status().running


# several pages


def test_five_pages_at_once(site):
    with ExitStack() as stack:
        pages = [stack.enter_context(site.connect()) for _ in range(5)]
        for opened in pages:
            assert first(opened, ready)["n_cells"]


def test_too_many_pages_are_told(site, monkeypatch):
    monkeypatch.setattr("tomoskin.server.page_connection.MAX_PAGES", 1)
    with site.connect() as one:
        first(one, "scene")
        with site.connect() as two, pytest.raises(ConnectionClosed) as closed:
            two.recv(PATIENCE)
        assert closed.value.rcvd.code == 1013
        assert first(one, "state")


@contextmanager
def deaf(site):
    """A page that opens and then reads nothing."""
    with socket.socket() as stuck:
        stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stuck.connect(("127.0.0.1", site.port))
        stuck.sendall(
            f"GET /ws?token={site.policy.token} HTTP/1.1\r\nHost: 127.0.0.1:{site.port}\r\n"
            "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
        )
        yield


def test_a_page_that_does_not_read_delays_nobody_and_is_let_go(site, monkeypatch):
    monkeypatch.setattr(page_connection, "PATIENCE", 1.0)  # of which a busy machine takes a part
    monkeypatch.setattr(page_connection, "FRAME_PERIOD", 0.001)
    with deaf(site), site.connect() as other:
        seen = []
        while True:
            message = other.recv(PATIENCE)
            if isinstance(message, bytes):
                seen.append(decode(message)["sequence"])
            elif json.loads(message).get("kind") == "page-dropped":
                break
        assert len(seen) > 5  # in that second, on a machine however busy
        assert seen == sorted(set(seen))
        assert site.runner.status().dropped == 0


def test_a_page_that_does_not_read_leaves_no_connection_behind(runner, static, monkeypatch):
    """What it was to be sent would be waited for without end."""
    monkeypatch.setattr(page_connection, "FRAME_PERIOD", 0.001)
    runner.start()
    site = Site(runner, static)
    with deaf(site), site.connect() as other:
        for _ in range(40):
            first(other, ready)
        site.stop()
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            gc.collect()
    assert [str(one.message) for one in said] == []


def test_stopping_with_a_page_open_is_quick(runner, static):
    runner.start()
    site = Site(runner, static)
    with site.connect() as opened:
        first(opened, "scene")
        site.stop()
        with pytest.raises(ConnectionClosed):
            first(opened, "never")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_before_it_begins_ends_it_at_once(runner, static, number):
    listener = listen("127.0.0.1", 0)
    policy = AccessPolicy(listener.getsockname()[1])
    server = Server.of(application(Hub(runner), policy, static))
    before = signal.getsignal(number)
    with server.stopped_by_signals():
        os.kill(os.getpid(), number)
        server.run_on(listener)
    assert signal.getsignal(number) is before


# the socket


def test_a_port_in_use():
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ServerError) as refused:
            listen("127.0.0.1", port)
    assert str(port) in str(refused.value)
    assert "--port" in str(refused.value)


def test_an_address_of_another_machine():
    with pytest.raises(ServerError, match="host 192"):
        listen("192.0.2.1", 0)


def test_a_page_that_was_not_built(tmp_path, static):
    check_page(static)
    with pytest.raises(ServerError, match="make live"):
        check_page(tmp_path / "none")


def test_a_runner_without_touchable_source_is_not_pressable(prepared, idle, static):
    class Deaf(Board):
        set_presses = None

    board = Deaf(free=idle)
    runner = Runner(prepared, lambda: board)
    runner.start()
    site = Site(runner, static)
    with site.connect() as page:
        scene = first(page, "scene")
        held = {"x": 0.01, "y": 0.02, "force": 3.0, "radius": 0.015}
        ask(page, type="presses", presses=[held])
        frame = first(page, ready)
    site.stop()
    runner.stop()
    assert not scene["pressable"]
    assert scene["source"] == "textile-disc-8 on board on the table"
    assert frame["n_truth"] == 0


# recording


def until_state(socket, wanted):
    while not wanted(state := first(socket, "state")):
        pass
    return state


def test_a_page_records_to_a_file_of_the_servers_choice(site, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with site.connect() as socket:
        ask(socket, type="record", on=True)
        name = until_state(socket, lambda state: state["recording"])["recording"]
        first(socket, ready)
        ask(socket, type="record", on=False)
        while (event := first(socket, "event"))["kind"] != "recorded":
            pass
        until_state(socket, lambda state: state["recording"] is None)
    assert name in event["text"]
    found = session_info(tmp_path / name)
    assert found.frames > 0
    assert not found.torn


def test_a_recording_that_cannot_begin_is_said_on_the_page(site, tmp_path, monkeypatch):
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()
    with site.connect() as socket:
        ask(socket, type="record", on=True)
        while (event := first(socket, "event"))["kind"] != "recording-stopped":
            pass
    assert "the recording did not start" in event["text"]
    Watch(site.runner).until(lambda: site.runner.status().running)
