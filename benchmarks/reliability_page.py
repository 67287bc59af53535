"""Requests of a page to the real server: drawn from the schema, and damaged."""

from __future__ import annotations

import contextlib
import json
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
from msgspec import inspect
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tomoskin.model.skin import Skin
from tomoskin.server.requests import REQUEST
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
    schema = inspect.type_info(REQUEST)
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
    status = Path(f"/proc/{process}/status").read_text()
    (line,) = [line for line in status.splitlines() if line.startswith("VmHWM")]
    return int(line.split()[1]) << 10


def _request(schema: inspect.Type, number: int) -> str:
    rng = random.Random(_SEED << 32 | number)
    text = json.dumps(_drawn(schema, rng))
    if number % 2:
        text = mutated(text.encode(), number, text=True).decode("utf-8", "replace")
    return text


def _drawn(kind: inspect.Type, rng: random.Random) -> Any:  # noqa: PLR0911, PLR0912 - a type each
    """A value that the type allows; at its bounds more often than between them."""
    match kind:
        case inspect.UnionType():
            return _drawn(rng.choice(kind.types), rng)
        case inspect.StructType():
            drawn = {f.encode_name: _drawn(f.type, rng) for f in kind.fields
                     if f.required or rng.random() < 0.5}  # fmt: skip
            if "changes" in drawn:
                drawn["changes"] = _changes(rng)
            return {kind.tag_field: kind.tag, **drawn} if kind.tag_field else drawn
        case inspect.BoolType():
            return rng.random() < 0.5
        case inspect.LiteralType():
            return rng.choice(kind.values)
        case inspect.StrType():
            return rng.choice(_NAMES)
        case inspect.IntType() | inspect.FloatType():
            return _number(kind, rng)
        case inspect.ListType() | inspect.VarTupleType():
            count = rng.randint(kind.min_length or 0, min(kind.max_length or 4, 4))
            return [_drawn(kind.item_type, rng) for _ in range(count)]
        case inspect.TupleType():
            return [_drawn(item, rng) for item in kind.item_types]
        case inspect.DictType():
            return {rng.choice(_NAMES): _drawn(kind.value_type, rng)}
        case inspect.NoneType():
            return None
        case inspect.Metadata():
            return _drawn(kind.type, rng)
        case _:
            return rng.choice(_EXTREMES)


def _number(kind: inspect.IntType | inspect.FloatType, rng: random.Random) -> float | int:
    low, high = (bound for bound in (kind.ge if kind.ge is not None else kind.gt,
                                     kind.le if kind.le is not None else kind.lt))  # fmt: skip
    inside = [x for x in (*_EXTREMES, low, high) if x is not None
              and (low is None or x >= low) and (high is None or x <= high)]  # fmt: skip
    if low is not None and high is not None:
        inside += [rng.uniform(low, high)] * 3
    value = rng.choice(inside or [0.0])
    return round(value) if isinstance(kind, inspect.IntType) else value


def _changes(rng: random.Random) -> dict[str, dict[str, Any]]:
    """Of one key of the skin file: another number, another word, or none."""
    document = msgspec.to_builtins(Skin.load(SKIN).document, builtin_types=(float,))
    section = rng.choice(sorted(name for name in document if isinstance(document[name], dict)))
    key = rng.choice(sorted(document[section]))
    value = rng.choice((*_EXTREMES, None, "auto", "10 mm", "5 ms", "1e9 m", "", [1, 2], 8, 31))
    return {section: {key: value}}
