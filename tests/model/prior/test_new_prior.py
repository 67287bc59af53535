"""The prior of CONTRIBUTING.md: its module and its line are all that a new prior needs."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
USE = """
import json
import numpy as np
from tomoskin import OneStep, Skin
from tomoskin.model.prior import penalty_of
from tomoskin.pipeline import prepare
from tomoskin.server.settings_messages import schema

skin = Skin.load("textile-disc-8")
skin = skin.altered({"mesh": {"cells": 300}, "inverse": {"prior": "central", "slope": 3}})
again = Skin.from_toml(skin.to_toml())
print(json.dumps([again.inverse.prior, again.inverse.slope]))
inverse = next(s for s in json.loads(schema().json)["sections"] if s["name"] == "inverse")
print(json.dumps(next(k for k in inverse["keys"] if k["name"] == "slope")))
prepared = prepare(again)
image = prepared.operator(np.linspace(0, 1e-3, prepared.pattern.n_meas))
own = OneStep(prepared.model, "central", alpha=1.0, conductivity=skin.conductivity)
q = penalty_of(again.inverse.record("prior"), prepared.mesh, own.problem.jacobian).matrix
print(json.dumps([bool(np.isfinite(image.values).all()), float(q.min()), float(q.max())]))
"""


def test_a_new_prior_is_its_module_and_its_line(tmp_path: Path) -> None:
    section = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split("### A new prior")[1]
    module, line = re.findall(r"```python\n(.*?)```", section, re.DOTALL)[:2]
    shutil.copytree(
        ROOT / "src" / "tomoskin",
        tmp_path / "tomoskin",
        ignore=shutil.ignore_patterns("static", "__pycache__"),
    )
    priors = tmp_path / "tomoskin" / "model" / "prior"
    (priors / "central.py").write_text(module, encoding="utf-8")
    table = (priors / "priors.py").read_text(encoding="utf-8")
    entry = re.compile(r"^(PRIORS: .*\{\n)", re.MULTILINE)
    table = entry.sub(rf"from tomoskin.model.prior.central import Central\n\1{line}", table)
    (priors / "priors.py").write_text(table, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-c", USE],
        cwd=tmp_path,
        env={"PYTHONPATH": str(tmp_path), "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    file, form, image = run.stdout.splitlines()
    assert file == '["central", 3.0]'
    assert '"low": 0, "high": 100' in form
    assert '"effective": {"key": "prior", "words": ["central"]}' in form
    finite, least, most = json.loads(image)
    assert finite
    assert 1.0 <= least < 1.1
    assert most == pytest.approx(4.0)
