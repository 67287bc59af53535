"""The example that needs no tomoskin reads the firmware's frames."""

import subprocess
import sys

from firmware.boards import ROOT, star_counts


def test_it_prints_a_hundred_right_frames(board):
    program = [sys.executable, str(ROOT / "examples" / "plain_reader.py"), board.path]
    ran = subprocess.run(program, capture_output=True, text=True, check=False, timeout=60)
    assert ran.returncode == 0, ran.stderr
    rows = [line.split() for line in ran.stdout.splitlines()]
    numbers = [int(row[0]) for row in rows]
    assert len(numbers) == 100
    # a board does not wait for a reader that is late: the numbers tell what was dropped
    assert numbers == sorted(set(numbers))
    assert all([int(count) for count in row[3:]] == star_counts(4) for row in rows)
