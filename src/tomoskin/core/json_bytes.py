"""JSON of anything that a run says, whatever the files that it names are called."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec


def encode_json(content: Any, enc_hook: Callable[[Any], Any] | None = None) -> bytes:
    """``content`` as JSON; ``?`` for what is no UTF-8, as some names of files are not."""
    try:
        return msgspec.json.encode(content, enc_hook=enc_hook)
    except UnicodeEncodeError:
        plain = msgspec.to_builtins(content, enc_hook=enc_hook)
        return msgspec.json.encode(_legible(plain))


def _legible(item: Any) -> Any:
    if isinstance(item, str):
        return item.encode("utf-8", "replace").decode()
    if isinstance(item, dict):
        return {_legible(key): _legible(value) for key, value in item.items()}
    return [_legible(value) for value in item] if isinstance(item, list | tuple) else item
