"""Requests of a page to the real server: drawn from the schema, and damaged."""

from __future__ import annotations

import contextlib
import json
import random
import re
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tomoskin.model.skin import Skin
from tomoskin.server.requests import Request
from trials import HANG, MEMORY, Tally, mutated

SKIN = "textile-disc-8"
BATCH = 50
"""Requests after which the server must still speak."""

_NAMES = ("a", "run.mcap", "textile-disc-8", "textile-disc-16", "touch.npz", "twin", "x-1", "none")
_EXTREMES = (0.0, -0.0, 1e-300, 1e-9, 1e-3, 0.05, 1.0, -1.0, 17.3, 1e6, 1e300)
_SEED = 1


def ask(count: int, folder: Path) -> Tally:
    """What becomes of ``count`` requests; even ones follow the schema, odd ones are damaged."""
    tally = Tally("requests")
    schema = msgspec.json.schema(Request)
    with _live(folder) as (process, address, errors):
        page = Page(address)
        for first in range(0, count, BATCH):
            batch = range(first, min(first + BATCH, count))
            for number in batch:
                page.send(_request(schema, number))
            if not page.hears_state():
                tally.add("hang", first, f"no state in {HANG:g} s")
                page = Page(address)
            if process.poll() is not None:
                tally.add("traceback", first, "the server has ended")
                break
        if not page.sees_frames():
            tally.add("wrong", count, "no frame comes any more")
        tally.counts["refused"] += page.refused
        tally.counts["accepted"] += count - page.refused
        if (peak := _peak(process.pid)) > MEMORY:
            tally.add("memory", count, f"{peak / 2**20:.0f} MB")
    text = errors.read_text(encoding="utf-8", errors="replace")
    for part in text.split("Traceback (most recent call last)")[1:]:
        tally.add("traceback", count, part.strip().splitlines()[-1])
    return tally


class Page:
    """A page that reads all that comes, and remembers when it last heard of what."""

    def __init__(self, address: str) -> None:
        self.refused = 0
        self._address = address
        self._news = threading.Condition()
        self._states = self._frames = 0
        self._open()

    def send(self, request: str) -> None:
        """One request; a page that was let go comes again."""
        try:
            self._connection.send(request)
        except ConnectionClosed:
            self._open()
            self._connection.send(request)

    def hears_state(self) -> bool:
        """Whether the server says within HANG how it is."""
        return self._hears("_states")

    def sees_frames(self) -> bool:
        """Whether frames come; after a replay or a pause they must be asked for."""
        for request in ({"type": "live"}, {"type": "pause", "on": False}, {"type": "presses",
                        "presses": []}):  # fmt: skip
            self.send(json.dumps(request))
        return self._hears("_frames")

    def _hears(self, what: str) -> bool:
        with self._news:
            before = getattr(self, what)
            return self._news.wait_for(lambda: getattr(self, what) > before + 1, HANG)

    def _open(self) -> None:
        self._connection: ClientConnection = connect(self._address, max_size=None)
        threading.Thread(target=self._read, args=(self._connection,), daemon=True).start()

    def _read(self, connection: ClientConnection) -> None:
        try:
            for message in connection:
                kind = "" if isinstance(message, bytes) else json.loads(message).get("type", "")
                with self._news:
                    self._states += kind == "state"
                    self._frames += isinstance(message, bytes)
                    self.refused += kind in ("refused", "error")
                    self._news.notify_all()
        except ConnectionClosed:
            return


@contextmanager
def _live(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str, Path]]:
    """``tomoskin live``, the address of its socket, and what it says on stderr."""
    errors = folder / "stderr.txt"
    code = "from tomoskin.cli import main; main()"
    command = [sys.executable, "-c", code, "live", "--port", "0", "--json", "--skin", SKIN,
               "--folder", str(folder)]  # fmt: skip
    with (
        errors.open("w") as file,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=file, text=True) as process,
    ):
        try:
            assert process.stdout
            started = json.loads(process.stdout.readline())
            yield process, started["address"].replace("http:", "ws:").replace("/?", "/ws?"), errors
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(HANG)
            process.kill()


def _peak(process: int) -> int:
    (line,) = re.findall(r"VmHWM:\s+(\d+)", Path(f"/proc/{process}/status").read_text())
    return int(line) << 10


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
