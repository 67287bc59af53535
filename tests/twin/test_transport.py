"""The twin as a source: pace, threads, options, and the whole way to voltages."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from tomoskin.board.source import Link, ScanSettings, Transport
from tomoskin.core import Frame, GeometryError, SkinError, SourceError, WallClock
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Scan
from tomoskin.sensing.signal import Readout
from tomoskin.twin import PRESETS, Faults, LineSettings, Press, TwinSettings, make_twin
from tomoskin.twin.source import open_twin

PRESS = Press(0.02, 0.01, 3.0, 0.015)


class ManualClock:
    """Time that passes only when somebody waits."""

    def __init__(self):
        self.time = 10.0

    def now(self):
        return self.time

    def wait(self, condition, seconds):  # noqa: ARG002 - the clock's signature
        self.time += seconds


def frames_of(transport, skin, count, clock=None):
    scan, settings = Scan.of(skin.pattern()), ScanSettings.of(skin)
    got = []
    link = Link(transport, scan, settings, clock=(clock or WallClock()).now)
    while len(got) < count:
        got += [item for item in link.poll(0.1) if isinstance(item, Frame)]
    return got, link


def test_voltages_are_the_models_within_the_noise(skin):
    clock = ManualClock()
    frames, link = frames_of(make_twin(skin, TwinSettings(), clock), skin, 40, clock)
    readout = Readout.of(Scan.of(skin.pattern()), skin.readout)
    volts = np.array([readout(frame).values for frame in frames])
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    expected = model.solve(skin.conductivity).voltages
    assert volts.mean(axis=0) == pytest.approx(expected, rel=0.03)
    lsb = 5.0 / 1024 / skin.readout.gain
    noise = lsb * np.sqrt(2 * (0.7**2 + 1 / 12) / skin.readout.oversampling)
    assert volts.std(axis=0).mean() == pytest.approx(noise, rel=0.1)
    link.close()


def test_the_same_seed_gives_the_same_bytes(skin):
    def samples(seed):
        clock = ManualClock()
        transport = make_twin(skin, TwinSettings(seed=seed), clock)
        transport.set_presses((PRESS,))
        frames, link = frames_of(transport, skin, 3, clock)
        link.close()
        return [(frame.ticks, frame.samples.tolist()) for frame in frames]

    assert samples(1) == samples(1)
    assert samples(1) != samples(2)


def test_pace_is_the_boards(skin):
    clock = ManualClock()
    frames, link = frames_of(make_twin(skin, TwinSettings(), clock), skin, 20, clock)
    period = 8 * 2.005e-3 + 48 * 16 * 52e-6
    assert np.diff([f.host_time for f in frames]) == pytest.approx(np.full(19, period), rel=1e-6)
    link.close()


def test_a_press_shows_in_the_next_frame_and_goes_again(skin):
    clock = ManualClock()
    transport = make_twin(skin, TwinSettings().with_noise(0.0), clock)
    (rest,), link = frames_of(transport, skin, 1, clock)

    def following():
        (frame,) = [item for item in link.poll(1.0) if isinstance(item, Frame)]
        return frame.samples.tolist()

    transport.set_presses((PRESS,))
    assert transport.sheet.presses == (PRESS,)
    assert following() != rest.samples.tolist()
    transport.set_presses(())
    assert following() == rest.samples.tolist()
    with pytest.raises(GeometryError, match="off the skin"):
        transport.set_presses((Press(0.5, 0.5, 1.0, 0.01),))
    assert following() == rest.samples.tolist()
    link.close()


def test_nothing_comes_within_the_timeout(skin):
    clock = ManualClock()
    transport = make_twin(skin, TwinSettings(), clock)
    assert transport.read(0.0)  # HELLO
    start = clock.time
    assert transport.read(0.3) == b""
    assert clock.time == pytest.approx(start + 0.3)


def test_close_wakes_a_reader_and_is_final(skin):
    transport = open_twin("", skin)
    transport.read(0.0)
    caught = []

    def reader():
        while True:
            try:
                transport.read(60.0)
            except SourceError as error:
                caught.append(error)
                return

    thread = threading.Thread(target=reader)
    thread.start()
    transport.close()
    transport.close()
    thread.join(timeout=10)
    assert not thread.is_alive()
    assert "switched off" in str(caught[0])
    with pytest.raises(SourceError, match="switched off"):
        transport.write(b"x")


def test_presses_from_many_threads(skin):
    transport = open_twin("fast", skin)
    stop = threading.Event()

    def presser(x):
        while not stop.is_set():
            transport.set_presses((Press(x, 0.0, 1.0, 0.01),))

    threads = [threading.Thread(target=presser, args=(0.01 * k,)) for k in range(3)]
    for thread in threads:
        thread.start()
    try:
        frames, link = frames_of(transport, skin, 20)
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    assert [frame.sequence for frame in frames] == list(range(len(frames)))
    link.close()


def test_a_reboot_forgets_the_scan_and_the_link_takes_it_up_again(skin):
    clock = ManualClock()
    transport = make_twin(skin, TwinSettings(), clock)
    _, link = frames_of(transport, skin, 3, clock)
    transport.reboot()
    after = []
    while len(after) < 3:
        after += [item for item in link.poll(0.1) if isinstance(item, Frame)]
    assert after[0].sequence == 0
    link.close()


def test_a_bad_line_loses_frames_and_never_alters_one(skin):
    clock = ManualClock()
    quiet = TwinSettings().with_noise(0.0)
    bad = replace(quiet, line=LineSettings(loss=5e-4, corruption=5e-4))
    (good, *_), link = frames_of(make_twin(skin, quiet, clock), skin, 1, clock)
    link.close()
    frames, link = frames_of(make_twin(skin, bad, clock), skin, 60, clock)
    link.close()
    sequences = [frame.sequence for frame in frames]
    assert sequences == sorted(sequences)
    assert sequences != list(range(60))
    assert all(frame.samples.tolist() == good.samples.tolist() for frame in frames)


def test_a_cut_electrode_shows_in_the_next_frame(skin):
    clock = ManualClock()
    transport = make_twin(skin, TwinSettings(), clock)
    _, link = frames_of(transport, skin, 1, clock)
    transport.set_faults(Faults(cut=frozenset({2})))
    readout = Readout.of(Scan.of(skin.pattern()), skin.readout)
    (frame,) = [item for item in link.poll(1.0) if isinstance(item, Frame)]
    railed = readout(frame).excluded
    pattern = skin.pattern()
    reads = (pattern.measure == 2).any(axis=1)
    assert railed[reads].all()
    drives = (pattern.drive == 2).any(axis=1)
    assert not railed[~reads & ~drives].any()
    link.close()


def test_the_skin_file_and_the_options_choose_the_material(skin):
    knit = skin.altered({"twin": {"preset": "textile"}})
    assert open_twin("", knit).sheet.material == TwinSettings.preset("textile").material
    other = open_twin("preset=hydrogel,noise=2.5", knit)
    assert other.sheet.material == TwinSettings.preset("hydrogel").material
    assert other.electronics.settings.noise == 2.5


def test_the_skin_file_knows_every_preset(skin):
    for name in PRESETS:
        assert skin.altered({"twin": {"preset": name}}).twin.preset == name
    with pytest.raises(SkinError, match="preset"):
        skin.altered({"twin": {"preset": "wool"}})


def test_options(skin):
    assert isinstance(open_twin("seed=3,fast", skin), Transport)
    of_seed = ("slow", "seed=-1", "seed=x", "seed=")
    for wrong in (*of_seed, "preset=wool", "noise=-1", "noise=nan", "noise="):
        with pytest.raises(SourceError, match="twin: expected"):
            open_twin(wrong, skin)
