"""The example that needs no tomoskin reads the firmware's frames."""

import subprocess
import sys

from firmware.boards import ROOT, star_counts


def test_it_prints_a_hundred_right_frames(board):
    program = [sys.executable, str(ROOT / "examples" / "plain_reader.py"), board.path]
    ran = subprocess.run(program, capture_output=True, text=True, check=False, timeout=60)
    assert ran.returncode == 0, ran.stderr
    rows = [line.split() for line in ran.stdout.splitlines()]
    assert [int(row[0]) for row in rows] == list(range(100))
    assert all([int(count) for count in row[3:]] == star_counts(4) for row in rows)
