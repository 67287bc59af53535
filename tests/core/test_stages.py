"""Long work that is watched."""

import asyncio

import pytest

from tomoskin.core import reach, watch_stages


def test_stages_are_told_to_the_innermost_watcher_also_in_a_thread():
    outer, inner = [], []
    reach("nobody watches")

    async def work():
        with watch_stages(outer.append):
            await asyncio.to_thread(reach, "one")
            with watch_stages(inner.append):
                reach()
            reach("two")

    asyncio.run(work())
    assert (outer, inner) == (["one", "two"], [""])


def test_what_a_watcher_raises_ends_the_work_and_the_watch():
    def stop(stage):
        raise KeyError(stage)

    with pytest.raises(KeyError, match="mesh"), watch_stages(stop):
        reach("mesh")
    reach("mesh")
