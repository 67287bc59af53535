"""Rate and latency over a bounded window, by stages, and what pages say of themselves."""

import json

import numpy as np
import pytest

from server.serving import Site
from server.test_server import ask, first, ready
from tomoskin.core import Frame
from tomoskin.run.status import Latency

STAGES = ["sample", "decode", "reconstruct", "publish", "paint"]


def frame(sequence, ticks):
    return Frame(sequence, ticks, 0.0, 0, 0, 0, np.zeros(1, "<u2"))


def test_nothing_is_known_at_first():
    stages = Latency().stages()
    assert [stage.name for stage in stages] == STAGES
    assert all(np.isnan([stage.p50, stage.p99]).all() for stage in stages)


def test_scans_are_timed_by_the_device_where_none_is_lost():
    latency = Latency()
    for number, ticks in [(0, 0), (1, 100), (2, 200), (5, 900), (6, 1010), (0, 20), (1, 110)]:
        latency.add_frame(frame(number, ticks), 0.0, 1000.0)
    (sample, *_) = latency.stages()
    assert sample.p50 == pytest.approx(0.1)
    assert 0.1 < sample.p99 <= 0.11


def test_before_the_first_frame():
    latency = Latency()
    assert np.isnan(latency.age()).all()
    assert latency.rate(0.0) == 0.0


def test_rate_is_of_the_last_second():
    latency = Latency()
    for k in range(101):
        latency.add_frame(frame(k, k), 0.01 * k, 1.0)
    assert latency.rate(1.0) == pytest.approx(100)
    assert latency.rate(5.0) == 0.0
    assert latency.frames == 101


def test_latency_forgets_what_is_old():
    latency = Latency(window=10)
    for seconds in [9.0] * 50 + [1.0] * 10:
        latency.add_result(0.0, seconds)
    assert latency.age() == (1.0, 1.0)


def test_percentiles():
    latency = Latency(window=101)
    for seconds in range(101):
        latency.add_result(0.0, float(seconds))
    assert latency.age() == (50.0, 99.0)


def test_of_several_pages_the_slowest_counts_until_it_goes():
    latency = Latency()
    latency.set_paint("a", 0.001, 0.002)
    latency.set_paint("b", 0.004, 0.02)
    assert latency.stages()[-1].p99 == 0.02
    latency.forget("b")
    assert latency.stages()[-1].p99 == 0.002


@pytest.fixture
def site(runner, tmp_path):
    (tmp_path / "index.html").write_text("<title>tomoskin</title>")
    runner.start()
    site = Site(runner, tmp_path)
    yield site
    site.stop()


def test_every_stage_is_told_to_pages_and_programs(site):
    """The state is sent four times a second; by then the page has said how long it paints."""
    with site.connect() as page:
        first(page, ready)
        ask(page, type="painted", p50_s=0.002, p99_s=0.005)
        while None in (known := {s["name"]: s["p99_ms"] for s in state(page)["stages"]}).values():
            pass
        assert list(known) == STAGES
        assert known["paint"] == 5.0
        assert known["reconstruct"] > 0
        with site.client() as client:
            told = json.loads(client.get("/status").text)["stages"]
        assert [stage["name"] for stage in told] == STAGES


def test_pages_and_programs_are_told_why_frames_were_slow(site):
    with site.connect() as page:
        while not (slowest := state(page)["slowest"]):
            pass
        assert " ms: " in slowest[0]["text"]
        with site.client() as client:
            assert json.loads(client.get("/status").text)["slowest"]


def state(page):
    return first(page, "state")


def test_an_impossible_time_is_refused(site):
    with site.connect() as page:
        ask(page, type="painted", p50_s=-1.0, p99_s=0.005)
        assert "p50_s" in first(page, "error")["message"]
