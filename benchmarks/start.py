"""From a skin to its first frame: nothing kept, all kept, another pattern."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from report import Report, progress, table
from tomoskin.core import archive
from tomoskin.model.forward import choose_engine, engine_choice

SKINS = ("textile-disc-8", "textile-disc-16", "textile-disc-32")
CORES = 2

STARTS = (("nothing kept", ""), ("kept", ""), ("another pattern", "opposite"))
"""One after the other, each a process of its own with the folder of the one before."""

_ONCE = """
import json, resource, sys, time
from threadpoolctl import threadpool_limits
from tomoskin import Skin
from tomoskin.pipeline import prepare
begun, used = time.perf_counter(), time.process_time()
skin = Skin.load(sys.argv[1])
if sys.argv[2]:
    skin = skin.altered({"drive": {"pattern": sys.argv[2]}})
with threadpool_limits(1):
    prepared = prepare(skin)
    prepared.warm_up()
taken = time.perf_counter() - begun, time.process_time() - used
parts = prepared.spots.tabulation.certificate.parts
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps([*taken, peak, float(sorted(parts)[int(0.95 * len(parts))])]))
"""


def run() -> Iterator[Report]:
    engines = ["scipy"] if choose_engine().core is None else ["native", "scipy"]
    rows = [row for name in SKINS for engine in engines for row in starts(name, engine)]
    yield table(
        "from a skin to its first frame",
        rows,
        "mesh, model, operator and the table of touches, without the time to import tomoskin; a "
        "process each, one after the other",
        "error: 95th percentile of what the table is off by, in parts of what a touch changes",
        f"load of the machine {os.getloadavg()[0]:.1f}",
    )


def starts(name: str, engine: str) -> Iterator[dict[str, Any]]:
    """The starts of one skin."""
    with tempfile.TemporaryDirectory() as folder:
        for what, pattern in STARTS:
            progress(f"{name}, {engine}: {what}")
            seconds, processor, peak, error = once(name, engine, pattern, Path(folder))
            yield {
                "skin": name,
                "engine": engine,
                "start": what,
                "s": round(seconds, 2),
                "processor s": round(processor, 2),
                "peak MB": round(peak),
                "error": round(error, 4),
            }


def once(name: str, engine: str, pattern: str, folder: Path) -> list[float]:
    """Seconds, processor seconds, peak MB and error of one start."""
    chosen = {engine_choice.VARIABLE: engine, archive.VARIABLE: str(folder)}
    words = [sys.executable, "-c", _ONCE, name, pattern]
    done = subprocess.run(
        words, env=os.environ | chosen, check=True, stdout=subprocess.PIPE, text=True
    )
    figures: list[float] = json.loads(done.stdout)
    return figures
