"""What holds of the figure of each example."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from types import ModuleType

from claims import Claim


def check_figure(module: ModuleType, claim: Claim, folder: Path, *, is_whole: bool = True) -> None:
    """Have the example make its figure in the folder, with the numbers that the gallery claims, or
    with others where it is not the whole of it."""
    found = module.main(["--out", str(folder)])
    assert len(found) > 1
    assert found.keys() <= claim.values.keys()
    assert not is_whole or claim.broken(found) == []
    assert all(math.isfinite(value) for value in found.values())
    data = (folder / f"{claim.name}.png").read_bytes()
    width, height = struct.unpack(">II", data[16:24])
    assert width > 400
    assert height > 250
