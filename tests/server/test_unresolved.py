"""The map of what the data cannot tell, as a page asks for it."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace

import numpy as np
import pytest

from server.test_settings import Heard
from tomoskin.pipeline import Unresolved
from tomoskin.server.hub import run_handlers
from tomoskin.server.page_connection import Tasks
from tomoskin.server.requests import AskUnresolved, decode_request


def at_one_moment(prepared, lost=()):
    """A run whose newest frame has measurements that do not count."""
    rows = np.isin(np.arange(prepared.pattern.n_meas), lost)
    result = SimpleNamespace(health=SimpleNamespace(lost=rows))
    return SimpleNamespace(
        prepared=prepared,
        newest=SimpleNamespace(result=result),
        flow=SimpleNamespace(pipeline=SimpleNamespace(choice=prepared.choice)),
    )


def asked(runner, tmp_path):
    page = Heard()

    async def ask():
        handlers = run_handlers(runner, tmp_path, Tasks())
        request = decode_request('{"type": "unresolved"}')
        assert type(request) is AskUnresolved
        handlers[AskUnresolved](page, request)
        await page.until(lambda: page.told)

    asyncio.run(ask())
    return page.last("unresolved")


def test_a_page_gets_the_map_of_the_moment(prepared, tmp_path):
    lost = prepared.pattern.rows_of(3)
    told = asked(at_one_moment(prepared, lost), tmp_path)
    expected = Unresolved.of(prepared, prepared.choice.alpha, lost)
    assert told["values"] == pytest.approx(expected.values, abs=6e-4)
    assert told["radius_m"] == pytest.approx(expected.radius)
    assert told["problem"] == ""


def test_before_the_first_frame_all_measurements_count(prepared, tmp_path):
    runner = at_one_moment(prepared)
    whole = asked(runner, tmp_path)
    runner.newest = None
    assert asked(runner, tmp_path) == whole
