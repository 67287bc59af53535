"""The device's clock by frames that come late, in batches, and now and then very late."""

import numpy as np
import pytest

from tomoskin.board.source.clock import ClockFitter, ClockWatch, ScanTimer
from tomoskin.core import DriveSamples, Frame

RATE, FAST, OFFSET = 250e3, 37e-6, 1234.5
PERIOD = 5e-3


def arrivals(seconds, *, batch, stalls, seed=3):
    """Ticks and host times: a USB bridge hands over every ``batch`` s, and the host is busy."""
    random = np.random.default_rng(seed)
    true = np.arange(0, seconds, PERIOD)
    late = 1e-4 + random.exponential(5e-4, len(true))
    late[random.random(len(true)) < stalls] += 0.2
    came = np.ceil((true + late) / batch) * batch if batch else true + late
    ticks = np.round(true * RATE * (1 + FAST)).astype(int) + 7_000_000
    return zip(ticks.tolist(), (OFFSET + np.maximum.accumulate(came)).tolist(), strict=True)


def fitted(frames):
    fitter = ClockFitter()
    for ticks, host_time in frames:
        fitter.add(ticks, host_time)
    return fitter


@pytest.mark.parametrize(("batch", "stalls"), [(0, 0), (0.016, 0), (0.016, 0.05), (0, 0.08)])
def test_drift_and_offset(batch, stalls):
    fit = fitted(arrivals(120, batch=batch, stalls=stalls)).fit
    assert fit.drift(RATE) == pytest.approx(FAST, abs=3e-6)
    tick_0 = OFFSET - 7_000_000 / (RATE * (1 + FAST))
    assert fit.offset == pytest.approx(tick_0, abs=1.5e-3)
    assert fit.frames == 24_000


def test_stalls_on_one_side_do_not_bend_it():
    """As when the machine grows busier: least squares would take it for a slow clock."""
    frames = list(arrivals(60, batch=0, stalls=0))
    late = [(t, h + (0.3 if n > 9_000 and n % 3 else 0)) for n, (t, h) in enumerate(frames)]
    assert fitted(late).fit.drift(RATE) == pytest.approx(FAST, abs=4e-6)


def test_the_residual_is_how_late_frames_are():
    exact = [(round(k * PERIOD * RATE), OFFSET + k * PERIOD) for k in range(1000)]
    assert fitted(exact).fit.residual == pytest.approx(0, abs=1e-5)
    late = [(t, h + (0.02 if n % 2 else 0)) for n, (t, h) in enumerate(exact)]
    assert fitted(late).fit.residual == pytest.approx(0.02 / np.sqrt(2), rel=0.01)


def test_a_device_that_starts_anew_is_fitted_anew():
    fitter = fitted(arrivals(60, batch=0, stalls=0))
    for k in range(19):
        fitter.add(k * 1250, 5000 + k * PERIOD)
    assert fitter.fit is None
    fitter.add(19 * 1250, 5000 + 19 * PERIOD)
    assert fitter.fit.frames == 20
    assert fitter.fit.offset == pytest.approx(5000)


def test_memory_is_bounded():
    fitter = ClockFitter()
    for k in range(20_000):  # ever slower: each frame is a corner of the hull
        fitter.add(1250 * k, k * PERIOD + 1e-9 * k**2)
    assert len(fitter._run.corners) <= 257
    assert fitter.fit.frames == 20_000


def test_frames_of_one_tick_are_no_clock():
    assert fitted([(5, 1.0)] * 50).fit is None


def framed(sequence, ticks, host_time):
    return Frame(sequence, ticks, host_time, 1, 0, 0, np.zeros(1, np.uint16))


def said(seconds, factor):
    """What is said of a clock that runs ``factor`` times as fast as its board states."""
    watch = ClockWatch()
    frames = (
        framed(0, ticks, host_time)
        for ticks, host_time in arrivals(seconds, batch=0.016, stalls=0.05)
    )
    return [event for frame in frames if (event := watch.push(frame, RATE / factor))]


@pytest.mark.parametrize("factor", [0.9, 1.1, 4])
def test_a_clock_that_is_not_as_stated_is_said_once(factor):
    (event,) = said(20, factor)
    assert event.kind == "clock"
    assert f"states a clock of {RATE / factor:,.0f} Hz" in event.text


def test_a_clock_as_stated_is_no_event():
    assert said(20, 1.02) == said(3, 2) == []


@pytest.mark.parametrize("wander", [0.0, 2e-5])
def test_a_scan_is_stamped_with_its_middle_however_late_the_frame_came(wander):
    """Frames up to 30 ms late, of a clock that is 300 ppm fast and wanders over ten minutes."""
    rng, clock, missed = np.random.default_rng(8), ScanTimer(), []
    interval = 0.055
    for k in range(int(600 / interval)):
        start = 5.0 + k * interval
        ticks = start * 1.0003 + wander * 100 * np.sin(start / 100)
        arrival = start + interval + rng.exponential(0.006) % 0.03
        frame = framed(k, round(16e6 * ticks), arrival)
        middle, duration = clock.middle(frame, 0.06, 16e6)
        if k > 100:
            missed.append(middle - (start + 0.5 * interval))
            assert duration == pytest.approx(interval, rel=1e-3)
    assert np.abs(missed).max() < 3e-3
    assert np.percentile(np.abs(missed), 50) < 1e-3


def test_a_drive_is_stamped_with_its_own_middle():
    """The third of eight, 30 ms late; frames come at once."""
    clock = ScanTimer()
    for k in range(30):
        clock.middle(framed(k, 12_500 * k, 100 + 0.05 * (k + 1)), 0.05, 250e3)
    part = DriveSamples(30, 12_500 * 30 + 3125, 101.5 + 0.01875 + 0.03, 1, 0, 0, 0, 2, 2, None)
    middle, length = clock.drive(part, 8)
    assert length == pytest.approx(0.00625)
    assert middle == pytest.approx(101.5 + 2.5 * 0.00625, abs=1e-4)


def test_a_drive_of_a_clock_that_is_fast_is_stamped_by_its_own_rate():
    """300 ppm are 0.2 s after ten minutes."""
    clock, rate = ScanTimer(), 250e3 * 1.0003
    for k in range(12_000):
        clock.middle(framed(k, round(rate * 0.05 * k), 100 + 0.05 * (k + 1)), 0.05, 250e3)
    start = 700.0 + 0.0125
    part = DriveSamples(12_000, round(rate * 600.0125), start + 0.03, 1, 0, 0, 0, 2, 2, None)
    assert clock.drive(part, 8)[0] == pytest.approx(start + 0.003125, abs=1e-3)


def test_without_a_clock_a_scan_is_stamped_by_its_arrival():
    frame = framed(0, 0, 7.0)
    assert ScanTimer().middle(frame, 0.06, 16e6) == (pytest.approx(6.97), 0.06)


@pytest.mark.parametrize(
    "glitch",
    [
        lambda ticks: np.where(np.arange(len(ticks)) < 500, ticks, ticks + 2**33),
        lambda ticks: np.where(np.arange(len(ticks)) == 500, ticks + 2**40, ticks),
        lambda ticks: np.where(np.arange(len(ticks)) == 500, ticks - 6_000_000, ticks),
        lambda ticks: np.where(np.arange(len(ticks)) == 501, ticks - 12_499, ticks),
        lambda ticks: np.where(np.arange(len(ticks)) < 500, ticks, ticks - ticks[500]),
    ],
    ids=["set ahead", "ahead once", "back once", "too soon once", "started again"],
)
def test_a_clock_that_stumbles_spoils_a_few_stamps_at_most(glitch):
    clock, spoilt = ScanTimer(), []
    for k, ticks in enumerate(glitch(7 + 12_500 * np.arange(2000)).tolist()):
        middle, duration = clock.middle(framed(k, ticks, 100 + 0.05 * k), 0.045, 250e3)
        if abs(middle - (100 + 0.05 * k - 0.0225)) > 1e-3 or duration != pytest.approx(0.045):
            spoilt.append(k)
    assert len(spoilt) <= 1
