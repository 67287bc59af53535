"""Golden files computed with EIDORS: mesh, settings and results, counted from 0.

Every convention is stated in the README beside the files. Tests and benchmarks read them here.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.sparse import coo_array

from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

SHARED = Path("eidors_golden") / "a_disc8_netgen.mat"
"""The case that is in the data folder."""


@dataclass(frozen=True, eq=False)
class Golden:
    """One golden case.

    ``sigma`` (3, n_cells) and ``impedance`` (3, n_electrodes) are the columns that the nine
    cases combine; ``fields`` holds every array of the file as it is.
    """

    mesh: Mesh
    pattern: Pattern
    current: float
    sigma: FloatArray
    impedance: FloatArray
    fields: dict[str, NDArray[Any]]

    @classmethod
    def load(cls, path: Path) -> Golden:
        """Read a case."""
        fields = {k: v for k, v in loadmat(path).items() if not k.startswith("__")}
        return cls(
            mesh=_mesh(fields),
            pattern=_pattern(fields),
            current=float(fields["stim"].max()),
            sigma=fields["sigma"].T,
            impedance=fields["z_contact"].T,
            fields=fields,
        )

    def model(self, impedance: int = 0) -> ForwardModel:
        """Forward model with that column of contact impedances."""
        return ForwardModel(self.mesh, self.pattern, self.impedance[impedance], self.current)

    def matrix(self, name: str) -> FloatArray:
        """Dense symmetric prior ``name`` from its (i, j, v) rows; an upper triangle is mirrored."""
        i, j, v = self.fields[name].T
        n = len(self.mesh.cells)
        entries = (v, (i.astype(int) - 1, j.astype(int) - 1))
        dense = np.asarray(coo_array(entries, shape=(n, n)).toarray())
        if name.endswith("_triu_ijv"):
            dense += np.triu(dense, 1).T
        return dense

    def hyperparameter(self, prior: str) -> float:
        """The hyper-parameter that the file used with ``prior``."""
        names = [str(name[0]) for name in self.fields["prior_names"].ravel()]
        return float(self.fields["hp"].ravel()[names.index(prior)])


def _mesh(fields: dict[str, NDArray[Any]]) -> Mesh:
    table = fields["elec_face_table"].astype(int)
    count = int(table[:, 0].max())
    electrodes = tuple(table[table[:, 0] == e + 1, 1:] - 1 for e in range(count))
    return Mesh(fields["nodes"], fields["elems"].astype(int) - 1, electrodes)


def _pattern(fields: dict[str, NDArray[Any]]) -> Pattern:
    stim, meas = fields["stim"], fields["meas"]
    drives = np.column_stack([stim.argmax(axis=1), stim.argmin(axis=1)])
    measure = np.column_stack([meas.argmax(axis=1), meas.argmin(axis=1)])
    index = fields["meas_stim"].ravel().astype(int) - 1
    return Pattern(stim.shape[1], drives, index, measure)


def mismatch(got: NDArray[Any], expected: NDArray[Any]) -> float:
    """Largest difference, relative to the largest expected value."""
    return float(np.abs(got - expected).max() / np.abs(expected).max())
