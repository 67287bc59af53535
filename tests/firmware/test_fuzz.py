"""Some seconds of what ``make fuzz`` does for long: libFuzzer on the board's parser."""

import re
import shutil

from firmware.boards import FIRMWARE, make
from firmware.conftest import need


def test_mutated_streams_break_nothing():
    makefile = (FIRMWARE / "Makefile").read_text(encoding="utf-8")
    names = re.search(r"for c in ([\w -]+);", makefile)[1].split()
    need([next(filter(shutil.which, names), "clang")], "clang libclang-rt-14-dev")
    made = make("fuzz", "RUNS=5000")
    assert made.returncode == 0, made.stderr[-2000:]
