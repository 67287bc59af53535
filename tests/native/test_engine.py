"""Both engines give the same numbers, and which one runs is said and can be chosen."""

from __future__ import annotations

import ast
import hashlib
import importlib
from typing import Any

import numpy as np
import pytest

import shapes
from conftest import NO_ENGINE, ROOT
from tomoskin.core import ModelError
from tomoskin.model.forward import (
    ForwardModel,
    State,
    Terminals,
    choose_engine,
    engine_choice,
)
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

TOLERANCE = 1e-12


@pytest.fixture(autouse=True)
def _fresh_choice(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.delenv(engine_choice.VARIABLE, raising=False)
    engine_choice._native.cache_clear()
    yield
    engine_choice._native.cache_clear()


def body() -> tuple[Mesh, Pattern]:
    """Tetrahedra with two electrodes on each of two opposite faces."""
    line = np.linspace(0.0, 0.1, 7)
    block = shapes.box(line, line, line)
    x, y, _ = block.points[block.boundary].mean(axis=1).T
    electrodes = tuple(
        block.boundary[(np.abs(x - face) < 1e-9) & (np.abs(y - centre) < 0.02)]
        for face in (0.0, 0.1)
        for centre in (0.02, 0.08)
    )
    return Mesh(block.points, block.cells, electrodes), Pattern.adjacent(4)


def sheet() -> tuple[Mesh, Pattern]:
    return shapes.disc(16, 1500), Pattern.adjacent(16)


def models(
    monkeypatch: pytest.MonkeyPatch, mesh: Mesh, pattern: Pattern, **settings: Any
) -> list[ForwardModel]:
    """Return the same model on the native engine and on scipy's."""
    pytest.importorskip("tomoskin_core", reason=NO_ENGINE)
    both = []
    for name in ("native", "scipy"):
        monkeypatch.setenv(engine_choice.VARIABLE, name)
        both.append(ForwardModel(mesh, pattern, **settings))
        assert both[-1].engine.name == name
    return both


def assert_same(native: Any, scipy: Any, scale: Any = None) -> None:
    """``scale``: what the numbers are differences of, whose rounding they have."""
    assert native.dtype == scipy.dtype
    largest = np.abs(scipy if scale is None else scale).max()
    np.testing.assert_allclose(native, scipy, rtol=0, atol=TOLERANCE * largest)


@pytest.mark.parametrize("domain", [sheet, body])
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("is_complex", [False, True])
def test_the_engines_agree(
    monkeypatch: pytest.MonkeyPatch, domain: Any, order: int, is_complex: bool
) -> None:
    mesh, pattern = domain()
    both = models(monkeypatch, mesh, pattern, contact_impedance=0.01, current=0.3, order=order)
    sigma = np.random.default_rng(1).uniform(0.3, 3.0, len(mesh.cells))
    states = [model.at(sigma * (1.0 + 0.4j) if is_complex else sigma) for model in both]
    for name in ("electrode_potentials", "potentials"):
        assert_same(*(getattr(state, name) for state in states))
    voltages = (state.voltages for state in states)
    assert_same(*voltages, scale=states[1].electrode_potentials)
    assert_same(*(state.basis for state in states))
    for name in ("gradient", "jacobian"):
        assert_same(*(getattr(state, name) for state in states))
    # the drop of potential across a contact is a difference of nearly equal numbers
    native, scipy = (state.contact_jacobian for state in states)
    np.testing.assert_allclose(native, scipy, rtol=0, atol=1e-10 * np.abs(scipy).max())
    for state in states:
        assert state.residual < 1e-12


def test_the_engines_agree_on_tensors_and_local_updates(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, pattern = sheet()
    both = models(monkeypatch, mesh, pattern, contact_impedance=0.01)
    tensor = np.broadcast_to([[2.0, 0.5], [0.5, 1.0]], (len(mesh.cells), 2, 2))
    assert_same(*(model.at(tensor).jacobian for model in both))
    cells = np.arange(40)
    changed = [model.at(1.0).local.voltages(cells, np.full(40, 3.0)) for model in both]
    assert_same(*changed)
    touches = [(np.arange(first, first + 40), np.full(40, 3.0 + 1j)) for first in (0, 90, 150)]
    assert_same(*(model.at(1.0).local.voltages_of(touches) for model in both))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("made", [sheet, body])
def test_the_electrodes_alone_see_what_the_whole_solve_says(
    monkeypatch: pytest.MonkeyPatch, made: Any, order: int
) -> None:
    mesh, pattern = made()
    both = models(monkeypatch, mesh, pattern, contact_impedance=2e-3, order=order)
    random = np.random.default_rng(31)
    axes = mesh.points.shape[1]
    part = random.standard_normal((len(mesh.cells), axes, axes))
    tensor = np.eye(axes) + part @ part.swapaxes(1, 2)
    for conductivity in (random.uniform(0.1, 9.0, len(mesh.cells)), tensor):
        for model in both:
            exact = State(model, conductivity).transfer_resistance
            found = Terminals(model).transfer_resistance(conductivity)
            assert np.abs(found - exact).max() < TOLERANCE * np.abs(exact).max()


def test_the_electrodes_alone_refuse_what_is_singular(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, pattern = sheet()
    for contact, value in ((1e-3, 0.0), (1e-3, np.nan), (1e-15, 1.0)):
        model = models(monkeypatch, mesh, pattern, contact_impedance=contact)[0]
        with pytest.raises(ModelError, match="singular"):
            Terminals(model).transfer_resistance(np.full(len(mesh.cells), value))


def test_the_electrodes_alone_have_complex_contacts(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, pattern = sheet()
    model = models(monkeypatch, mesh, pattern, contact_impedance=1e-3 - 1e-4j)[0]
    even = np.ones(len(mesh.cells))
    exact = State(model, even).transfer_resistance
    assert Terminals(model).transfer_resistance(even) == pytest.approx(exact)


def test_a_system_that_is_singular_to_rounding_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, pattern = sheet()
    sigma = np.where(np.arange(len(mesh.cells)) % 2, 1e-180, 1e180)
    for model in models(monkeypatch, mesh, pattern, contact_impedance=1e-300):
        with pytest.raises(ModelError, match="singular"):
            model.solve(sigma)


def test_the_structure_is_analysed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, pattern = sheet()
    model, _ = models(monkeypatch, mesh, pattern, contact_impedance=0.01)
    assert model.at(1.0).factor is not model.at(1.0).factor
    assert model.factorise is model.factorise


def test_scipy_runs_where_the_extension_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ModuleNotFoundError(name=name)

    monkeypatch.setattr(importlib, "import_module", missing)
    engine = choose_engine()
    assert (engine.name, engine.reason) == ("scipy", "tomoskin_core is not installed")
    monkeypatch.setenv(engine_choice.VARIABLE, "native")
    with pytest.raises(ModelError, match="not installed"):
        choose_engine()


def test_scipy_runs_where_the_extension_does_not_work(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken:
        __version__ = "9"

    monkeypatch.setattr(importlib, "import_module", lambda _: Broken)
    engine = choose_engine()
    assert engine.name == "scipy"
    assert "does not work" in engine.reason


def test_scipy_runs_where_the_extension_was_built_for_another_tomoskin(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    core = pytest.importorskip("tomoskin_core", reason=NO_ENGINE)
    monkeypatch.setattr(core, "interface", core.interface - 1)
    engine = choose_engine()
    assert engine.name == "scipy"
    assert "built for another tomoskin" in engine.reason
    assert "make native" in engine.reason


def test_a_change_of_the_interface_raises_its_number() -> None:
    """The sum of what the stub says, beside the number; change both, in Rust and in Python."""
    stub = (ROOT / "core-native" / "tomoskin_core.pyi").read_text(encoding="utf-8")
    signatures = ast.unparse(_without_docs(ast.parse(stub)))
    assert (engine_choice.INTERFACE, hashlib.sha256(signatures.encode()).hexdigest()[:8]) == (
        8,
        "325b8653",
    )


def _without_docs(tree: ast.AST) -> ast.AST:
    for node in ast.walk(tree):
        lines = getattr(node, "body", None)
        if isinstance(lines, list):
            lines[:] = [line for line in lines if not _is_doc(line)] or [ast.Pass()]
    return tree


def _is_doc(line: ast.AST) -> bool:
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)


def test_the_variable_chooses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(engine_choice.VARIABLE, "scipy")
    assert choose_engine().name == "scipy"
    monkeypatch.setenv(engine_choice.VARIABLE, "fast")
    with pytest.raises(ModelError, match="fast"):
        choose_engine()


def test_the_extension_runs_where_it_is_installed() -> None:
    pytest.importorskip("tomoskin_core", reason=NO_ENGINE)
    engine = choose_engine()
    assert engine.name == "native"
    assert "tomoskin_core" in engine.reason
