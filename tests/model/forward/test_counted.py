"""What is done once is not done twice: factorisations and solves counted, not timed."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin


class Counting:
    """An engine that counts what it is asked, and passes it on."""

    def __init__(self, engine: Any) -> None:
        self._engine = engine
        self.asked: Counter[str] = Counter()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._engine, name)

    def analyse(self, *structure: Any) -> Any:
        factorise = self._engine.analyse(*structure)
        self.asked["analyse"] += 1

        def counted(values: Any) -> Any:
            self.asked["factorise"] += 1
            return _Factor(factorise(values), self.asked)

        return counted

    def jacobian(self, *given: Any) -> Any:
        self.asked["jacobian"] += 1
        return self._engine.jacobian(*given)


class _Factor:
    def __init__(self, factor: Any, asked: Counter[str]) -> None:
        self._factor, self._asked = factor, asked

    def __getattr__(self, name: str) -> Any:
        return getattr(self._factor, name)

    def columns(self, rows: Any) -> Any:
        return self._counted("columns", rows)

    def checked_columns(self, values: Any, rows: Any) -> Any:
        return self._counted("checked_columns", values, rows)

    def _counted(self, name: str, *given: Any) -> Any:
        self._asked["solve"] += 1
        self._asked["columns"] += len(given[-1])
        return getattr(self._factor, name)(*given)


@pytest.fixture
def model() -> ForwardModel:
    """A model of eight electrodes whose engine counts."""
    skin = Skin.load("textile-disc-8")
    made = ForwardModel(skin.mesh(), skin.pattern(), 1e-2)
    counting: Any = Counting(made.engine)
    made.engine = counting
    return made


def test_a_solve_is_one_factorisation_and_one_solve_of_all_fields(model) -> None:
    model.solve(1.0)
    assert model.engine.asked == {"analyse": 1, "factorise": 1, "solve": 1, "columns": 7}


def test_a_jacobian_costs_no_solve_more(model) -> None:
    model.jacobian(1.0)
    assert model.engine.asked.pop("jacobian") == 1
    assert model.engine.asked == {"analyse": 1, "factorise": 1, "solve": 1, "columns": 7}


def test_a_state_shares_what_it_has(model) -> None:
    state = model.at(1.0)
    for _ in range(2):
        assert state.voltages.shape == state.jacobian.shape[:1]
    assert model.engine.asked["factorise"] == model.engine.asked["jacobian"] == 1
    assert model.engine.asked["columns"] == 7


def test_a_new_conductivity_needs_no_new_analysis(model) -> None:
    for value in (1.0, 2.0, 3.0):
        model.solve(value)
    assert model.engine.asked == {"analyse": 1, "factorise": 3, "solve": 3, "columns": 21}


def test_touches_beyond_the_first_solve_nothing_on_the_sheet(model) -> None:
    """The local update works in the patch: its columns are solved once for all touches of it."""
    local = model.at(1.0).local
    cells = np.arange(12)
    local.voltages_of([(cells, np.full(12, 0.8))])
    once = Counter(model.engine.asked)
    for value in (0.7, 0.6, 0.5):
        local.voltages_of([(cells, np.full(12, value))])
    assert model.engine.asked == once
    assert once["factorise"] == 1


def test_the_operator_is_made_from_one_state(model) -> None:
    operator = OneStep(model, alpha=1e-3)
    asked = Counter(model.engine.asked)
    assert asked["analyse"] == asked["factorise"] == asked["jacobian"] == 1
    operator(np.zeros(model.pattern.n_meas))
    assert model.engine.asked == asked
