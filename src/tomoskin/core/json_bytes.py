"""JSON of anything that a run says, whatever the files that it names are called."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np


def encode_json(content: Any) -> bytes:
    """``content`` as JSON, numbers to the bit: null for what is not finite, ``?`` for what is no
    UTF-8, as some names of files are not."""
    try:
        return msgspec.json.encode(content, enc_hook=_number)
    except UnicodeEncodeError:
        return msgspec.json.encode(_legible(msgspec.to_builtins(content, enc_hook=_number)))


def plain_values(item: Any) -> dict[str, Any]:
    """A mapping or a record as plain values by name."""
    if isinstance(item, Mapping):
        return dict(item)
    values: dict[str, Any] = msgspec.to_builtins(item, enc_hook=_number)
    return values


def _number(item: Any) -> Any:
    if isinstance(item, np.generic | np.ndarray):
        return item.tolist()
    raise NotImplementedError(f"expected plain values, got {type(item).__name__}")


def _legible(item: Any) -> Any:
    if isinstance(item, str):
        return item.encode("utf-8", "replace").decode()
    if isinstance(item, dict):
        return {_legible(key): _legible(value) for key, value in item.items()}
    return [_legible(value) for value in item] if isinstance(item, list | tuple) else item
