"""The documentation page of the twin's script, written from the schema (docs/simulate.md)."""

from __future__ import annotations

from tomoskin.skin import section_text
from tomoskin.twin.script_schema import SECTIONS

_HEAD = """\
# Simulating a skin

`tomoskin simulate --skin textile-disc-8 --script my.toml --out my.mcap` lets the twin of a skin
follow a script, faster than real time, into a session file: raw bytes, frames, and the truth, what
pressed where and how hard, and how the sheet was bent. `tomoskin image my.mcap` reconstructs it,
`tomoskin live --source replay:my.mcap` plays it. The same script, skin and `--seed` give the same
bytes. Ctrl-C leaves a file that is readable up to there, with a note at its end that says so.

What presses moves during a scan too, and so does what bends, as on a bench: each drive sees the
sheet as it is in the middle of that drive. The truth of a frame is that of the middle of its scan.

The reference is what comes before the first press, bend or fault, 20 frames of it at most: the file
says so. With a shorter lead-in there are fewer, and each picture bears more of their noise. A
replay always takes 20: leave it that many (on `textile-disc-8`, 1.2 s).

A script is TOML, strict as the skin file is: unknown keys, wrong units, ids that overlap, probes
off the skin, stages too short for a frame to show and boards that read before they have settled are
errors that name file, section and key, said before anything is simulated.

```toml
"""

EXAMPLE = """\
format = 1

[script]
duration = "8 s"
seed = 1

[[press]]
id = "finger"
shape = "finger"
at = ["-40 mm", "20 mm"]
path = [["1 s", "-40 mm", "20 mm"], ["3 s", "40 mm", "20 mm"]]
start = "1 s"
force = "4 N"
hold = "3 s"

[[press]]
id = "weight"
radius = "15 mm"
at = ["0 mm", "-40 mm"]
start = "2 s"
profile = [["100 ms", "4 N"], ["4 s", "4 N"], ["4.1 s", "0 N"]]

[[fault]]
kind = "cut"
start = "7 s"
end = "7.5 s"
electrode = 2

[[mark]]
at = "7 s"
text = "E3 comes off"
"""
"""The page's example of a script."""

_LABELLED = """\
```

## Labelled frames

`tomoskin simulate --skin textile-disc-8 --presses 10000 --seed 1 --out DIR` draws presses at random
and writes what the board reads of each, as [interchange files](interchange.md) of 500 frames
(`part-00000.npz`, …), or as one with `--out FILE.npz`. Each frame is of a sheet that nothing
pressed before. `--script` gives another distribution:

```toml
"""

PRESSES_EXAMPLE = """\
format = 1

[presses]
count = [1, 3]
shapes = ["circle", "square"]
size = ["8 mm", "20 mm"]
force = ["1 N", "8 N"]
"""
"""The page's example of a distribution."""

_ARRAYS = """\
```

Beside `voltages`, `reference`, `drive` and `measure` a file holds `xy_m` (n_frames, 2), the place
where there is exactly one press, else NaN; and of each press, NaN or empty where a frame has fewer:
`press_xy_m` (n_frames, most, 2) m, `force_n`, `radius_m` (of the circle with the area of the face),
`angle_rad` and `shape`, (n_frames, most).

Shards are spread over the machine's processors (`--processes N`), or over machines by Dask
(`--cluster tcp://HOST:8786`, with `pip install 'tomoskin[cluster]'` and tomoskin on the workers).
Each shard has a seed of its own, so that the data do not depend on the number of workers. A command
that was stopped goes on where it was when it is given again; files of another set in the folder are
refused, or with `--force` written over.

Each process first imports the twin and solves the dents of the faces that it draws: 25 for the
usual presses, 2.5 s of processor time. Then 500 frames of `textile-disc-8` take 0.8 s. 4,000 took
8.6 s of processor time in one process, and 8.0 s in each of two (seed 1): a second one saves little
below some ten thousand frames. By the clock, on two cores that others kept busy (load 10), 5,000
took 44 s in one process and 63 s in two (the least of two runs each); a quiet machine was not to be
had. `tomoskin bench twin` measures both.

"""


def script_page() -> str:
    """Text of docs/simulate.md."""
    sections = "\n".join(section_text(section) for section in SECTIONS)
    return f"{_HEAD}{EXAMPLE}{_LABELLED}{PRESSES_EXAMPLE}{_ARRAYS}{sections}"
