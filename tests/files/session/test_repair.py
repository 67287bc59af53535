"""A repair of a long file says how far it is."""

from __future__ import annotations

import pytest

from files.session.runs import write_frames
from tomoskin.core import DataError
from tomoskin.files.session import repair


def test_a_repair_says_how_far_it_is_in_long_damage_too(tmp_path):
    """Of a file that is mostly zeros, in both looks at it."""
    data = write_frames(tmp_path / "small.mcap", 60, rate=10.0).read_bytes()
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(data[: 2 * len(data) // 3] + bytes(20_000_000))
    parts = []
    repair(torn, tmp_path / "mended.mcap", advance=lambda done, total: parts.append(done / total))
    assert parts == sorted(parts)
    assert max(b - a for a, b in zip([0.0, *parts], parts, strict=False)) < 0.1
    assert parts[-1] == pytest.approx(1.0)
    torn.write_bytes(bytes(8_000_000))
    seen = len(parts)
    with pytest.raises(DataError, match="nothing can be recovered"):
        repair(torn, tmp_path / "none.mcap", advance=lambda done, total: parts.append(done / total))
    assert len(parts) > seen + 5
