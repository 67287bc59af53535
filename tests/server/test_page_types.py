"""The page's types and readers are those of what the server declares."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

from tomoskin.server import frames, page_messages, robot_messages, settings_messages

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("types", ROOT / "scripts/page_types.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_types_are_not_stale(script):
    assert script.TYPES.read_text(encoding="utf-8") == script.types()


def test_they_hold_every_message_and_request(script):
    made = script.types()
    for message in (*page_messages.PAGE_MESSAGES, *settings_messages.SETTINGS_MESSAGES):
        assert f"export interface {message.__name__} {{\n  readonly type: " in made
    assert '  readonly type: "flow_label";' in made
    assert "  readonly sure?: boolean;" in made
    assert "  readonly errors_mm?: readonly number[];" in made
    assert f"TOUCH_BYTES = {frames.RECORDS['Touch'].itemsize};" in made
    assert re.search(r"covXy: data\.getFloat32\(at \+ 36, true\)", made)


def test_what_is_not_finite_goes_out_as_null():
    stage = page_messages.StageNow(name="wire", p50_ms=float("nan"), p99_ms=float("inf"))
    skins = robot_messages.RobotState(skins={}, recording=None)
    assert json.loads(skins.json) == {"type": "robot-state", "skins": {}, "recording": None}
    assert json.loads(page_messages.encode_json(stage))["p50_ms"] is None


def test_check_says_stale(script, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(script, "TYPES", tmp_path / "wire.ts")
    script.TYPES.write_text("old", encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["page_types.py", "--check"])
    assert script.main() == 1
    assert "stale" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["page_types.py"])
    assert script.main() == 0
    monkeypatch.setattr("sys.argv", ["page_types.py", "--check"])
    assert script.main() == 0
