"""The alternating drive from the host's side: what is set, read back, chosen and refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from board.source.boards import (
    BOARD,
    HELLO,
    SCAN,
    SETTINGS,
    ManualClock,
    ScriptedBoard,
    events,
    frames,
    linked,
    poll_until,
    twin_transport,
)
from tomoskin.board.source import BOARDS, Link, ScanSettings, choose_periods, chop_limit
from tomoskin.board.wire import OLDER, BoardLimits, DriveMode, GetBoard, GetInfo, HeldMode, SetMode
from tomoskin.core import SourceError, VirtualClock
from tomoskin.files.session import SessionReader, SessionWriter, read_session
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Readout
from tomoskin.sensing.signal.readout import directions
from tomoskin.twin import TwinSettings, make_twin

CHOPPED = replace(SETTINGS, chop_frequency=500)
TICKS = 250e3


@pytest.fixture
def clock():
    return ManualClock()


def chopped_skin(**more):
    drive = {"mode": "chopped", "chop_frequency": "0.2 kHz"}
    return Skin.load("textile-disc-8").altered({"drive": drive, **more})


def test_the_mode_is_set_and_read_back_before_start(clock):
    board = ScriptedBoard(clock)
    link = linked(board, clock, chop_frequency=500)
    link.connect()
    assert board.names == [
        *("GetInfo", "Stop", "GetBoard", "SetScan", "SetPattern", "SetFormat", "SetMode"),
        *("GetScan", "GetPattern", "GetMode", "Start"),
    ]
    mode = next(command for command in board.commands if isinstance(command, SetMode))
    assert (mode.mode, mode.frequency, mode.periods) == (DriveMode.CHOPPED, 500, 1)
    assert mode.configuration == link.session.configuration.identity
    assert link.session.board.text == "simulated board"


def test_a_board_that_holds_another_mode_is_refused(clock):
    board = ScriptedBoard(clock)
    held = board.held

    def forgetful(command):
        answer = held(command)
        return replace(answer, frequency=499) if isinstance(answer, HeldMode) else answer

    board.held = forgetful
    with pytest.raises(SourceError, match="frequency 499, expected 500"):
        linked(board, clock, chop_frequency=500).connect()
    assert "Start" not in board.names


@pytest.mark.parametrize("minor", [0, 1])
def test_an_older_board_is_set_up_in_its_own_words_or_refused(clock, minor):
    old = {"minor": minor, "schema_hash": OLDER[1, minor]}

    def board():
        one = ScriptedBoard(clock, hello=replace(HELLO, **old))
        answer = one.answer
        one.answer = lambda command: (
            [replace(BOARD.info(command.request), **old)]
            if isinstance(command, GetInfo)
            else answer(command)
        )
        return one

    direct = board()
    link = linked(direct, clock)
    link.connect()
    assert not {"GetBoard", "SetMode", "GetMode"} & set(direct.names)
    assert link.session.board is None
    with pytest.raises(SourceError, match=rf"from protocol 1.2 on; this one speaks 1.{minor}"):
        linked(board(), clock, chop_frequency=500).connect()


NEIGHBOUR, JUMPER = (
    replace(BOARD.limits, name=BOARDS[name].text.encode().ljust(24, b"\0"))
    for name in ("pico", "mega")
)


def named(clock, limits):
    """A board that calls itself as ``limits`` says."""
    board = ScriptedBoard(clock)
    answer = board.answer
    board.answer = lambda command: (
        [replace(limits, request=command.request)]
        if isinstance(command, GetBoard)
        else answer(command)
    )
    return board


def test_neighbours_are_not_driven_alternately_where_one_of_them_is_read_against(clock):
    board = named(clock, NEIGHBOUR)
    with pytest.raises(SourceError) as refused:
        linked(board, clock, chop_frequency=500).connect()
    assert "8 drives, 8 cannot be read alternately" in str(refused.value)
    assert "skip:1" in str(refused.value)
    assert "Start" not in board.names
    linked(named(clock, NEIGHBOUR), clock).connect()  # in one direction they can be read


def test_where_a_jumper_chooses_it_is_said(clock):
    def said(**changes):
        link = linked(named(clock, JUMPER), clock, chop_frequency=500, **changes)
        items = []
        while not link.running:
            items += link.poll(0.3)
        return [event.text for event in events(items) if event.kind == "driven-reference"]

    assert said() == []
    (text,) = said(against_neighbour=True)
    assert "J41 at 1-2" in text
    assert "skip:1" in text


def test_a_chopped_scan_has_an_identity_of_its_own_whatever_the_board_chooses(clock):
    direct, slow, fast = (
        linked(ScriptedBoard(clock), clock, chop_frequency=f).session.configuration
        for f in (0, 400, 500)
    )
    assert len({direct, slow, fast}) == 3


limits = st.builds(
    BoardLimits,
    request=st.just(0),
    name=st.just(b"board".ljust(24, b"\0")),
    min_chop=st.just(10),
    max_chop=st.integers(100, 20_000),
    half=st.integers(0, 60_000),
    sample=st.integers(0, 20_000),
    conversion=st.integers(0, 60_000),
    clock=st.integers(0, 1000),
)


@given(limits, st.sampled_from([2, 4, 6, 16, 64]), st.integers(10, 20_000), st.integers(1, 32))
def test_the_fewest_periods_that_fit_are_chosen(board, oversampling, frequency, channels):
    settings = replace(SETTINGS, oversampling=oversampling, chop_frequency=frequency)
    possible = [p for p in range(1, oversampling // 2 + 1) if oversampling % (2 * p) == 0]
    fits = [p for p in possible if frequency <= chop_limit(board, settings, p, channels, TICKS)]
    if fits:
        assert choose_periods(board, settings, channels, TICKS, "") == fits[0]
        return
    most = max(chop_limit(board, settings, p, channels, TICKS) for p in possible)
    with pytest.raises(SourceError, match=f"the board does at most {most} Hz"):
        choose_periods(board, settings, channels, TICKS, "")


def test_what_cannot_be_halved_or_is_too_slow_is_refused():
    board = BOARD.limits
    with pytest.raises(SourceError, match="3 conversions a sample cannot be halved"):
        choose_periods(board, replace(CHOPPED, oversampling=3), 6, TICKS, "")
    with pytest.raises(SourceError, match="at least 10 Hz"):
        choose_periods(board, replace(CHOPPED, chop_frequency=9), 6, TICKS, "")
    assert choose_periods(board, SETTINGS, 6, TICKS, "") == 0


def test_a_board_with_too_little_room_for_two_values_a_sample(clock):
    board = ScriptedBoard(clock)
    board.answer = lambda command: [replace(BOARD.info(command.request), max_samples=95)]
    with pytest.raises(SourceError, match="needs 96 values, two for each sample, in a frame"):
        linked(board, clock, chop_frequency=500).connect()


def test_the_twins_board_demodulates(clock):
    transport = twin_transport(clock)
    got = []
    with Link(transport, SCAN, CHOPPED, clock=clock.now) as link:
        got = frames(poll_until(link, lambda items: len(frames(items)) == 3))
    n = SCAN.n_samples
    counts = np.arange(2 * n).reshape(8, 2, 6)  # by drive, direction and channel
    for number, frame in enumerate(got):
        ahead, back = (counts + number)[:, 0].ravel(), (counts + number)[:, 1].ravel()
        assert (frame.samples.astype(int) - 0x8000).tolist() == (ahead - back).tolist()
        assert frame.sums.tolist() == (ahead + back).tolist()
        assert np.array_equal(directions(frame.samples, frame.sums), (ahead, back))
    assert np.diff([frame.ticks for frame in got]) == pytest.approx(8 / 500 * 250e3, abs=1)


def test_the_readout_finds_rails_in_either_direction():
    skin = chopped_skin()
    scan, settings = SCAN, skin.readout
    readout = Readout.of(scan, settings)
    top = (2**settings.adc_bits - 1) * settings.oversampling // 2
    ahead, back = np.full(scan.n_samples, 3000), np.full(scan.n_samples, 2000)
    back[scan.plus[7]] = top
    ahead[scan.minus[20]] = 0
    samples = (ahead - back + 0x8000).astype(np.uint16)
    values, railed = readout.rows(samples, (ahead + back).astype(np.uint16))
    bad = [scan.plus[7], scan.minus[20]]
    assert railed.tolist() == (np.isin(scan.plus, bad) | np.isin(scan.minus, bad)).tolist()
    assert values[~railed] == pytest.approx(0.0)


def test_a_chopped_session_is_kept_and_read_to_the_bit(tmp_path):
    """Through wire, file and read-out: what is read is what a direct drive reads."""
    voltages = {}
    for mode in ("direct", "chopped"):
        skin = chopped_skin(twin={"preset": "ideal"})
        if mode == "direct":
            skin = Skin.load("textile-disc-8").altered({"twin": {"preset": "ideal"}})
        clock = VirtualClock()
        transport = make_twin(skin, TwinSettings.preset("ideal").with_noise(0.0), clock)
        scan_settings = ScanSettings.of(skin)
        path = tmp_path / f"{mode}.mcap"
        with (
            Link(transport, SCAN, scan_settings, clock=clock.now) as link,
            SessionWriter(path, skin) as session,
        ):
            items = poll_until(link, lambda items: len(frames(items)) == 3)
            for frame in frames(items):
                session.frame(frame)
        with SessionReader(path) as reader:
            kept = [item.frame for item in reader.frames()]
        for before, after in zip(frames(items), kept, strict=True):
            assert np.array_equal(before.samples, after.samples)
            assert (before.sums is None) == (after.sums is None) == (mode == "direct")
            if before.sums is not None:
                assert np.array_equal(before.sums, after.sums)
        voltages[mode] = read_session(path).voltages[0]
        if mode == "chopped":
            live = Readout.of(SCAN, skin.readout)(kept[0])
            assert np.array_equal(np.where(live.excluded, np.nan, live.values), voltages[mode],
                                  equal_nan=True)  # fmt: skip
    step = skin.readout.reference_voltage / (2**skin.readout.adc_bits * skin.readout.gain)
    assert voltages["chopped"] == pytest.approx(voltages["direct"], abs=2 * step)
