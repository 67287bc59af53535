"""Peak memory of a forward solve and a Jacobian, in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from forward_cases import PATTERN, Case
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh

_STATUS = Path("/proc/self/status")


def peaks(case: Case) -> dict[str, float]:
    """MB above the process with its mesh: after ``forward``, after ``jacobian`` too."""
    if not _STATUS.exists():
        return {}
    with tempfile.TemporaryDirectory() as folder:
        path, mesh = Path(folder) / "mesh.npz", case.mesh
        facets = {f"electrode{i:03}": e for i, e in enumerate(mesh.electrodes)}
        np.savez(path, points=mesh.points, cells=mesh.cells, z=case.contact_impedance, **facets)
        command = [sys.executable, __file__, str(path)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def _measure(path: str) -> dict[str, float]:
    with np.load(path) as data:
        facets = tuple(data[key] for key in sorted(data) if key.startswith("electrode"))
        mesh, z = Mesh(data["points"], data["cells"], facets), float(data["z"])
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the check of the mesh
    base = _kilobytes("VmRSS")
    state = ForwardModel(mesh, PATTERN, z).at(1.0)
    assert state.solution.residual < 1e-6
    forward = _kilobytes("VmHWM")
    assert np.isfinite(state.jacobian[:, 0]).all()
    jacobian = _kilobytes("VmHWM")
    return {"forward": (forward - base) / 1e3, "jacobian": (jacobian - base) / 1e3}


def _kilobytes(name: str) -> float:
    lines = _STATUS.read_text(encoding="ascii").splitlines()
    return float(next(line for line in lines if line.startswith(name)).split()[1])


if __name__ == "__main__":
    print(json.dumps(_measure(sys.argv[1])))
