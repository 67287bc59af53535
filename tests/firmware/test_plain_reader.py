"""The example that needs no tomoskin reads the firmware's frames."""

import contextlib
import os
import subprocess
import sys
import tty

from firmware.boards import PATIENCE, ROOT, star_counts
from tomoskin.board.wire import OLDER, Fault, FaultCode, Hello, encode


def started(program):
    return subprocess.run(program, capture_output=True, text=True, check=False, timeout=PATIENCE)


def test_it_prints_a_hundred_right_frames(board):
    program = [sys.executable, str(ROOT / "examples" / "plain_reader.py"), board.path]
    # a board whose process had to wait is right to switch off: the reader says so and begins again
    while (ran := started(program)).returncode != 0:
        assert ran.stderr.startswith("the board has switched its current off: fault"), ran.stderr
    rows = [line.split() for line in ran.stdout.splitlines()]
    numbers = [int(row[0]) for row in rows]
    assert len(numbers) == 100
    # a board does not wait for a reader that is late: the numbers tell what was dropped
    assert numbers == sorted(set(numbers))
    assert all([int(count) for count in row[3:]] == star_counts(4) for row in rows)


def test_it_says_why_no_more_frames_come():
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    version, schema = min(OLDER.items())
    off = encode(Hello(*version, schema)) + encode(Fault(123, FaultCode.CURRENT_TOO_LONG, 0))
    program = [sys.executable, str(ROOT / "examples" / "plain_reader.py"), os.ttyname(theirs)]
    with subprocess.Popen(program, stderr=subprocess.PIPE, text=True) as reader:
        while reader.poll() is None:  # what comes before it listens is lost
            os.write(ours, off)
            with contextlib.suppress(subprocess.TimeoutExpired):
                reader.wait(0.1)
        assert "fault 4" in reader.stderr.read()
    os.close(ours)
    os.close(theirs)
