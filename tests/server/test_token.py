"""A token that outlives its server."""

from __future__ import annotations

import os

import pytest

from tomoskin.core import DataError
from tomoskin.server import Door, kept_token


def test_it_is_kept_and_for_its_owner_alone(tmp_path):
    path = tmp_path / "token"
    token = kept_token(path)
    assert kept_token(path) == token
    assert len(token) >= 32
    assert path.stat().st_mode & 0o777 == 0o600
    assert Door(1, token=token).has_token(f"token={token}")
    assert kept_token(tmp_path / "other") != token


def test_what_others_can_read_or_holds_no_token_is_refused(tmp_path):
    path = tmp_path / "token"
    kept_token(path)
    if os.name == "posix":
        path.chmod(0o644)
        with pytest.raises(DataError, match="others may read"):
            kept_token(path)
        path.chmod(0o600)
    for text in ("short", "a b" * 20, "é" * 40, ""):
        path.write_text(text)
        with pytest.raises(DataError):
            kept_token(path)
    with pytest.raises(DataError, match="cannot be made"):
        kept_token(tmp_path / "none" / "token")
