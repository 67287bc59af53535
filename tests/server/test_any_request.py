"""Requests that nobody thought of: drawn from the schema, every other one damaged."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from damage import mutated
from tomoskin.core import WireError
from tomoskin.model.skin import Skin
from tomoskin.server.requests import REQUEST, decode_request

SKIN, HANG = "textile-disc-8", 10.0
_NAMES = ("a", "run.mcap", "textile-disc-8", "textile-disc-16", "touch.npz", "twin", "x-1", "none")
_EXTREMES = (0.0, -0.0, 1e-300, 1e-9, 1e-3, 0.05, 1.0, -1.0, 17.3, 1e6, 1e300)
_SEED = 1
SCHEMA = msgspec.json.schema(REQUEST)


def test_any_request_is_understood_or_refused() -> None:
    refused = [0, 0]
    for number in range(1000):
        try:
            decode_request(_request(SCHEMA, number))
        except WireError:
            refused[number % 2] += 1
    assert refused[0] < 300 < refused[1]


@pytest.mark.slow
def test_a_server_that_is_asked_anything_still_speaks(tmp_path: Path) -> None:
    errors = tmp_path / "stderr.txt"
    with _live(tmp_path, errors) as address:
        for first in range(0, 300, 50):
            with connect(address, max_size=None) as page:
                try:
                    for number in range(first, first + 50):
                        page.send(_request(SCHEMA, number))
                        _heard(page, 0.01)
                except ConnectionClosed:
                    continue  # a page that floods is let go
        with connect(address, max_size=None) as page:
            assert _heard(page, HANG)
    assert "Traceback" not in errors.read_text(encoding="utf-8", errors="replace")


def _heard(page: ClientConnection, seconds: float) -> bool:
    try:
        return bool(page.recv(seconds))
    except TimeoutError:
        return False


@contextmanager
def _live(folder: Path, errors: Path) -> Iterator[str]:
    """``tomoskin live``: the address of its socket."""
    code = "from tomoskin.cli import main; main()"
    command = [sys.executable, "-c", code, "live", "--port", "0", "--json", "--skin", SKIN]
    command += ["--folder", str(folder)]
    with (
        errors.open("w") as file,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=file, text=True) as process,
    ):
        try:
            assert process.stdout
            started = json.loads(process.stdout.readline())
            yield started["address"].replace("http:", "ws:").replace("/?", "/ws?")
            assert process.poll() is None
        finally:
            process.kill()


def _request(schema: Mapping[str, Any], number: int) -> str:
    rng = random.Random(_SEED << 32 | number)
    text = json.dumps(_drawn(schema, schema["$defs"], rng))
    if number % 2:
        text = mutated(text.encode(), number, text=True).decode("utf-8", "replace")
    return text


def _drawn(kind: Mapping[str, Any], named: Mapping[str, Any], rng: random.Random) -> Any:  # noqa: PLR0911 - a kind each
    """A value that a JSON schema allows; at its bounds more often than between them."""
    if "$ref" in kind:
        return _drawn(named[kind["$ref"].rpartition("/")[2]], named, rng)
    if options := kind.get("anyOf") or kind.get("oneOf"):
        return _drawn(rng.choice(options), named, rng)
    if "enum" in kind:
        return rng.choice(kind["enum"])
    match kind.get("type"):
        case "object":
            fields, other = kind.get("properties", {}), kind.get("additionalProperties")
            drawn = {
                name: _changes(rng) if name == "changes" else _drawn(value, named, rng)
                for name, value in fields.items()
                if name in kind.get("required", ()) or rng.random() < 0.5
            }
            values = other if isinstance(other, dict) else {}
            return drawn or {rng.choice(_NAMES): _drawn(values, named, rng)}
        case "array":
            count = rng.randint(kind.get("minItems", 0), min(kind.get("maxItems", 4), 4))
            items = kind.get("prefixItems") or [kind.get("items") or {}] * count
            return [_drawn(item, named, rng) for item in items]
        case "integer" | "number":
            low = kind.get("minimum", kind.get("exclusiveMinimum", -np.inf))
            high = kind.get("maximum", kind.get("exclusiveMaximum", np.inf))
            inside = [x for x in (*_EXTREMES, low, high) if low <= x <= high and np.isfinite(x)]
            between = [rng.uniform(low, high)] * 3 if np.isfinite([low, high]).all() else []
            value = rng.choice([*inside, *between] or [0.0])
            return round(value) if kind["type"] == "integer" else value
    choices = {"boolean": (False, True), "string": _NAMES, "null": (None,)}
    return rng.choice(choices.get(str(kind.get("type")), _EXTREMES))


def _changes(rng: random.Random) -> dict[str, dict[str, Any]]:
    """Of one key of the skin file: another number, another word, or none."""
    document = msgspec.to_builtins(Skin.load(SKIN).document, builtin_types=(float,))
    section = rng.choice(sorted(name for name in document if isinstance(document[name], dict)))
    key = rng.choice(sorted(document[section]))
    value = rng.choice((*_EXTREMES, None, "auto", "10 mm", "5 ms", "1e9 m", "", [1, 2], 8, 31))
    return {section: {key: value}}
