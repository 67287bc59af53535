"""The table of an uneven sheet, changed from that of an even one; and one that was kept."""

from __future__ import annotations

import numpy as np

from sensing.fit.test_finder import model
from sensing.fit.test_table import drawn
from tomoskin.core import FloatArray, finished
from tomoskin.sensing.fit import Response
from tomoskin.sensing.fit.candidates import Candidates, footprints_of
from tomoskin.sensing.fit.table import ResponseTable
from tomoskin.sensing.fit.tabulate import kept_tabulation
from tomoskin.sensing.fit.uneven_sheet import field_modes

UNEVEN, LENGTH = 0.2, 0.05
"""Standard deviation of log σ, and m over which it changes."""


def uneven() -> Response:
    even = model().response.state
    modes = field_modes(even.model.mesh, LENGTH)
    change = UNEVEN * modes @ np.random.default_rng(5).standard_normal(modes.shape[1])
    return Response(even.model.at(even.conductivity * np.exp(change)))


def errors(response: Response, table: ResponseTable) -> FloatArray:
    """(n,) of single spots, in parts of what each changes."""
    spots = np.concatenate(drawn(40, 0.08))
    exact = response.changes([spot[None] for spot in spots])
    found = table.expanded(spots)[:, 0] @ table.basis
    return np.asarray(np.linalg.norm(found - exact, axis=1) / np.linalg.norm(exact, axis=1))


def test_an_uneven_sheets_table_is_nearly_as_exact_as_an_even_ones() -> None:
    even, there = model().tabulation, uneven()
    table = finished(even.adapted(there))
    own, adapted = errors(model().response, even.table), errors(there, table)
    plain = errors(there, even.table)
    assert np.median(adapted) < np.median(own) + 5e-3
    assert adapted.max() < 1.5 * own.max() + 1e-2
    assert np.median(plain) > 10 * np.median(adapted)
    certificate = finished(even.certificate.adapted(there, table))
    assert 0.5 * np.median(adapted) < certificate.moved < 3 * np.median(adapted)


def test_candidates_of_an_uneven_sheet_are_those_made_for_it() -> None:
    ours, there = model(), uneven()
    feet = footprints_of(ours.response, ours.prior)
    found = finished(ours.candidates.adapted(ours.response, there, feet))
    made = Candidates.of(there, ours.prior)
    size = np.linalg.norm(made.signatures, axis=1)
    wrong = np.linalg.norm(found.signatures - made.signatures, axis=1) / size
    plain = np.linalg.norm(ours.candidates.signatures - made.signatures, axis=1) / size
    np.testing.assert_array_equal(found.spots, made.spots)
    assert np.median(wrong) < 0.02
    assert np.median(plain) > 5 * np.median(wrong)


def test_one_that_was_kept_is_the_same_to_the_bit() -> None:
    ours = model()
    again = kept_tabulation(ours.response, ours.prior, ours.sign)
    for name in ("values", "basis", "nodes", "log_radii"):
        np.testing.assert_array_equal(
            getattr(again.table, name), getattr(ours.tabulation.table, name)
        )
    np.testing.assert_array_equal(again.parts, ours.tabulation.parts)
    for name, array in ours.tabulation.certificate.packed().items():
        np.testing.assert_array_equal(again.certificate.packed()[name], array)
