"""Figure 3.1: the disc as a mesh of triangles.

The built-in skin ``textile-disc-8``, 200 mm across, as the inverse sees it.

Shown: the triangles, smaller towards the eight electrodes, where the field changes fastest.
Thesis saw: 661 triangles and 362 nodes.
Checked: as many of either, within 10 %; no triangle is flatter than a quality of 0.5 (equilateral:
1); the reference voltages on this mesh differ from those on one with 16 times the triangles by less
than 1 % of the largest.
Assumed: nothing; the number of triangles that is asked for, 660, is that of the skin file.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import figures
from lab import options_of, report
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh, quality, triangulate
from tomoskin.model.skin import Skin

TRIANGLES, NODES = 661, 362
"""The thesis's mesh."""


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Mesh, check, draw; the numbers that were checked."""
    options = options_of("fig31_mesh", arguments, __doc__)
    skin = Skin.load(options.skin)
    mesh = skin.mesh()
    found = check(mesh, discretisation_error(skin, mesh))
    made, axes = figures.figure(1, 1, (4.2, 4.0))
    ax = axes[0, 0]
    x, y = figures.MM * mesh.points.T
    ax.triplot(x, y, mesh.cells, color=figures.BLUE, linewidth=0.5)
    figures.draw_electrodes(ax, mesh)
    ax.set_title(f"{len(mesh.cells)} triangles, {len(mesh.points)} nodes")
    ax.set_ylabel("y / mm")
    options.figure.save(made)
    return found


def discretisation_error(skin: Skin, mesh: Mesh) -> float:
    """Largest difference of the voltages from those on a fine mesh, over the largest voltage."""
    fine = triangulate(skin.outline, skin.arcs, 16 * len(mesh.cells))
    coarse, exact = (
        ForwardModel(m, skin.pattern(), skin.contact_impedance, skin.current)
        .solve(skin.conductivity)
        .voltages
        for m in (mesh, fine)
    )
    return float(np.abs(coarse - exact).max() / np.abs(exact).max())


def check(mesh: Mesh, error: float) -> dict[str, float]:
    """The mesh and the error of its voltages."""
    cells, points, least = len(mesh.cells), len(mesh.points), quality(mesh).minimum
    assert abs(cells - TRIANGLES) < 0.1 * TRIANGLES, f"{cells} triangles"
    assert abs(points - NODES) < 0.1 * NODES, f"{points} nodes"
    assert least > 0.5, f"a triangle of quality {least:.2f}"
    assert error < 0.01, f"voltages are off by {error:.3f}"
    return {
        "triangles": cells,
        "nodes": points,
        "least quality": least,
        "error of the voltages": error,
    }


if __name__ == "__main__":
    report(main())
