"""Files of calibrations that were written before files were packed by the annotations of what they
hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.learning import Kind, load_calibration
from tomoskin.model.pattern import Pattern

ABOUT = ("kind", "version", "drive", "measure", "n_electrodes", "skin_name", "pattern")
OPTIONAL = ("skin", "strength", "spread_m2", "method", "session", "angle_rad", "axis_rad")
"""Keys of what a file is of, and of what a calibration can do without."""

RENAMED = {"force_n": "amount"}
"""Keys that these files have for what is called so now."""


def read_earlier(path: Path, kind: Kind[Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """What its model is packed as now, and what the file holds."""
    known = kind.read(path)
    assert load_calibration(path).kind is kind
    assert (known.skin_name, known.pattern.identity) == ("a skin", Pattern.adjacent(8).identity)
    assert getattr(known.model, "skin_id", "a skin's identity") == "a skin's identity"
    with np.load(path) as kept:
        then = {RENAMED.get(key, key): kept[key] for key in {*kept} - {*ABOUT}}
    return kind.pack(known.model), then


def check_nothing_may_lack(path: Path, kind: Kind[Any], folder: Path) -> None:
    """A file without any of its keys, but for those that it can do without, is refused by name."""
    with np.load(path) as kept:
        arrays = dict(kept)
    for key in {*arrays} - {*ABOUT, *OPTIONAL}:
        np.savez(folder / "c.npz", **{k: v for k, v in arrays.items() if k != key})
        with pytest.raises(
            DataError, match=f"expected {RENAMED.get(key, key)} in the file"
        ) as caught:
            kind.read(folder / "c.npz")
        assert "c.npz" in str(caught.value)
