"""From HELLO to the first frame, with boards that lose, refuse and differ."""

from dataclasses import replace

import pytest

from board.source.boards import (
    BOARD,
    HELLO,
    SCAN,
    SET_UP,
    SETTINGS,
    ManualClock,
    ScriptedBoard,
    events,
    frames,
    linked,
    poll_until,
    twin_transport,
)
from tomoskin.board.source import Link, ScanSettings, Timing
from tomoskin.board.wire import (
    OLDER,
    Ack,
    Format,
    GetInfo,
    GetScan,
    Result,
    SetPattern,
    SetScan,
    Start,
    Stop,
    type_byte,
)
from tomoskin.core import SourceError, WireError
from tomoskin.model.pattern import Pattern, Scan


@pytest.fixture
def clock():
    return ManualClock()


def test_the_order_of_the_handshake(clock):
    board = ScriptedBoard(clock)
    link = linked(board, clock)
    info = link.connect()
    assert board.names == SET_UP
    assert info.channels == 8
    scan, pattern, chosen = board.commands[3:6]
    start = board.commands[-1]
    assert chosen.format is Format.SIXTEEN
    assert (
        scan.configuration
        == pattern.configuration
        == start.configuration
        == link.session.configuration.identity
    )
    assert (scan.n_drives, scan.settling, scan.dead_time) == (8, 200, 5)
    assert (scan.oversampling, scan.prescaler, scan.current_limit) == (4, 64, 100_000)
    assert [(d.source, d.sink) for d in pattern.drives] == [((k + 1) % 8, k) for k in range(8)]
    assert [d.mask for d in pattern.drives] == SCAN.masks.tolist()
    requests = [command.request for command in board.commands]
    assert len(set(requests)) == len(requests)


def test_nothing_is_sent_before_hello(clock):
    board = ScriptedBoard(clock, hello=None)
    link = linked(board, clock)
    end = clock.time + 2.9
    while clock.time < end:
        assert link.poll(0.1) == []
    assert board.commands == []
    board.say(HELLO)
    link.connect()
    assert board.names[0] == "GetInfo"


def test_a_board_without_hello_is_asked_after_a_while(clock):
    board = ScriptedBoard(clock, hello=None)
    linked(board, clock).connect()
    assert clock.time == pytest.approx(1003.0)


def test_a_board_that_is_already_scanning_is_taken_over(clock):
    transport = twin_transport(clock)
    first = linked(transport, clock)
    poll_until(first, frames)
    second = linked(transport, clock, oversampling=1)
    items = poll_until(second, frames)
    assert frames(items)[0].sequence == 0
    assert frames(items)[0].configuration == second.session.configuration.identity
    assert second.session.configuration.identity != first.session.configuration.identity


def test_a_long_pattern_goes_in_chunks_that_fit(clock):
    from tomoskin.model.pattern import Pattern, Scan

    scan = Scan.of(Pattern.all_pairs(8))
    board = ScriptedBoard(clock)
    settings = ScanSettings(oversampling=1, settling=1e-4, current_limit=0.1, adc_bits=10)
    Link(board, scan, settings, clock=clock.now).connect()
    chunks = [command for command in board.commands if isinstance(command, SetPattern)]
    assert [chunk.first for chunk in chunks] == [0, 9, 18, 27]
    sent = [(d.source, d.sink) for chunk in chunks for d in chunk.drives]
    assert sent == [tuple(drive) for drive in scan.drives.tolist()]


@pytest.mark.parametrize("lost", [GetInfo, Stop, SetScan, SetPattern, Start])
def test_a_lost_answer_is_asked_for_again_with_the_same_bytes(clock, lost):
    board = ScriptedBoard(clock)
    answer, losses = board.answer, []

    def forgetful(command):
        if isinstance(command, lost) and len(losses) < 2:
            losses.append(command)
            return []
        return answer(command)

    board.answer = forgetful
    linked(board, clock).connect()
    again = [command for command in board.commands if isinstance(command, lost)]
    assert len(again) == 3
    assert len(set(again)) == 1
    assert clock.time == pytest.approx(1000.6)


def test_a_board_that_never_answers_is_given_up(clock):
    board = ScriptedBoard(clock)
    board.answer = lambda _: []
    link = linked(board, clock)
    with pytest.raises(SourceError, match="no answer to GetInfo after 5 tries"):
        link.connect()
    assert len(board.commands) == 5


def test_answers_to_other_requests_are_not_taken(clock):
    board = ScriptedBoard(clock)
    answer = board.answer

    def confused(command):
        right = answer(command)
        if isinstance(command, GetInfo):
            return [replace(right[0], request=200), *right]
        wrong_id = Ack(200, type_byte(type(command)), Result.BUSY, 0)
        wrong_type = Ack(command.request, 0x82, Result.BUSY, 0)
        return [wrong_id, wrong_type, *right]

    board.answer = confused
    assert linked(board, clock).connect().request != 200


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"major": 0}, "the board speaks 0.4: the board's firmware is older"),
        ({"major": 2}, "the board speaks 2.4: this tomoskin is older"),
        ({"minor": 7, "schema_hash": 1}, "the board speaks 1.7: this tomoskin is older"),
        ({"schema_hash": 0xABC}, "different schemas .board 00000abc"),
        ({"minor": 0, "schema_hash": 0xABC}, "both speak protocol 1.0, .* .board 00000abc"),
    ],
)
@pytest.mark.parametrize("where", ["hello", "info"])
def test_a_drifted_board_is_refused_with_who_is_older(clock, change, said, where):
    board = ScriptedBoard(clock, hello=replace(HELLO, **change) if where == "hello" else HELLO)
    if where == "info":
        board.answer = lambda command: [replace(BOARD.info(command.request), **change)]
    with pytest.raises(WireError, match=said):
        linked(board, clock).connect()
    assert "SetScan" not in board.names


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"channels": 4}, "needs 8 electrodes, but the board has at most 4"),
        ({"max_drives": 7}, "needs 8 drives"),
        ({"max_samples": 47}, "needs 48 samples"),
        ({"max_oversampling": 2}, "needs 4 conversions"),
        ({"adc_bits": 8}, "the board's converter has 8"),
        ({"adc_bits": 13}, "the board's converter has 13 .*multiple of 8"),
        ({"tick_rate": 0}, "clock of 0 Hz; expected 100 Hz to 100 MHz"),
        ({"tick_rate": 2**32 - 1}, "clock of 4,294,967,295 Hz"),
        ({"current": 200_000}, "limiter is set to 200 mA, but this skin allows at most 100 mA"),
    ],
)
def test_a_board_that_cannot_do_the_scan(clock, change, said):
    board = ScriptedBoard(clock)
    board.answer = lambda command: [replace(BOARD.info(command.request), **change)]
    with pytest.raises(SourceError, match=said):
        linked(board, clock).connect()
    assert board.names == ["GetInfo"]


@pytest.mark.parametrize(
    ("kind", "change", "said"),
    [
        ("scan", {"settling": 2000}, "settling 2000, expected 200"),
        ("scan", {"format": Format.PACKED}, "format"),
        ("scan", {"n_drives": 7}, "n_drives 7, expected 8"),
        ("pattern", {"first": 1}, "first 1, expected 0"),
        ("pattern", {"drives": ()}, r"drives \(\), expected"),
    ],
)
def test_a_board_that_holds_something_else_is_refused(clock, kind, change, said):
    board = ScriptedBoard(clock)
    held = board.held

    def forgetful(command):
        bent = isinstance(command, GetScan) == (kind == "scan")
        return replace(held(command), **change) if bent else held(command)

    board.held = forgetful
    with pytest.raises(SourceError, match=f"did not store what was sent: it has {said}"):
        linked(board, clock).connect()
    assert "Start" not in board.names


def test_an_ack_is_no_answer_to_a_question(clock):
    board = ScriptedBoard(clock)
    board.held = lambda command: Ack(command.request, type_byte(type(command)), Result.OK, 0)
    with pytest.raises(SourceError, match="no answer to GetScan"):
        linked(board, clock).connect()


def test_a_board_of_the_first_version_is_set_up_in_its_own_words(clock):
    old = {"minor": 0, "schema_hash": OLDER[1, 0]}
    board = ScriptedBoard(clock, hello=replace(HELLO, **old))
    answer = board.answer

    def first_version(command):
        if isinstance(command, GetInfo):
            return [replace(BOARD.info(command.request), **old)]
        assert type_byte(type(command)) <= 0x89
        return answer(command)

    board.answer = first_version
    linked(board, clock, oversampling=1).connect()
    assert board.names == ["GetInfo", "Stop", "SetScan", "SetPattern", "Start"]


def test_samples_of_one_conversion_come_packed(clock):
    transport = twin_transport(clock, board=BOARD)
    heard = []
    with Link(transport, SCAN, replace(SETTINGS, oversampling=1), clock=clock.now,
              tap=lambda _, data: heard.append(data)) as link:  # fmt: skip
        got = frames(poll_until(link, lambda items: len(frames(items)) == 5))
    assert got[3].samples.tolist() == list(range(3, 51))
    assert len(heard[-1]) < 18 + 2 * 48  # shorter than its samples of 16 bits


def test_a_refusal_is_told_in_words(clock):
    board = ScriptedBoard(clock)
    answer = board.answer

    def stubborn(command):
        if isinstance(command, SetPattern):
            return [Ack(command.request, 0x86, Result.SAME_ELECTRODE, 3)]
        return answer(command)

    board.answer = stubborn
    with pytest.raises(SourceError, match=r"refused SetPattern: source and sink .* \(3\)"):
        linked(board, clock).connect()


@pytest.mark.parametrize(
    ("field", "said"),
    [
        (3, r"settling of 200 µs is out of range \(.* at most 100,000\)"),
        (6, r"prescaler of 64 is out of range \(.* 16, 32, 64 or 128\)"),
        (99, r"a value is out of range.* \(99\)"),
    ],
)
def test_a_value_out_of_range_is_named_with_its_limit(clock, field, said):
    board = ScriptedBoard(clock)
    answer = board.answer

    def narrow(command):
        if isinstance(command, SetScan):
            return [Ack(command.request, 0x85, Result.BAD_VALUE, field)]
        return answer(command)

    board.answer = narrow
    with pytest.raises(SourceError, match=f"refused SetScan: {said}"):
        linked(board, clock).connect()
    assert "Start" not in board.names


def test_a_mega_refuses_32_electrodes_before_anything_is_set(clock):
    board = ScriptedBoard(clock)
    board.answer = lambda command: [replace(BOARD.info(command.request), channels=16)]
    link = Link(board, Scan.of(Pattern.adjacent(32)), SETTINGS, clock=clock.now)
    said = r"needs 32 .* at most 16 .*or a Raspberry Pi Pico, which has up to 32"
    with pytest.raises(SourceError, match=said):
        link.connect()
    assert board.names == ["GetInfo"]


def test_a_board_that_resets_during_set_up_is_set_up_anew(clock):
    board = ScriptedBoard(clock)
    answer, resets = board.answer, []

    def shaky(command):
        if isinstance(command, SetScan) and not resets:
            resets.append(command)
            return [HELLO]
        return answer(command)

    board.answer = shaky
    linked(board, clock).connect()
    assert board.names == [
        *("GetInfo", "Stop", "GetBoard", "SetScan"),
        *SET_UP,
    ]


def test_a_board_that_resets_for_ever_is_given_up(clock):
    board = ScriptedBoard(clock)
    answer = board.answer
    board.answer = lambda c: [HELLO] if isinstance(c, Start) else answer(c)
    with pytest.raises(SourceError, match="resets repeatedly"):
        linked(board, clock).connect()


def test_garbage_before_hello_is_counted_and_harmless(clock):
    board = ScriptedBoard(clock, hello=None)
    board.say(b"\x55\xaa" * 3000, b"\r\nok\r\n\0", HELLO)
    link = linked(board, clock)
    link.connect()
    assert link.counters.corrupt == 1


def test_connected_is_an_event(clock):
    board = ScriptedBoard(clock)
    link = linked(board, clock)
    (event,) = events(poll_until(link, lambda _: link.running))
    assert event.kind == "connected"
    assert "8 channels" in event.text


def test_the_same_scan_has_the_same_identity_and_another_has_another(clock):
    one, same, other = (
        linked(ScriptedBoard(clock), clock, oversampling=n).session.configuration for n in (4, 4, 8)
    )
    assert one == same != other


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"oversampling": 0}, "from 1 to 64, got 0"),
        ({"oversampling": 64, "adc_bits": 12}, "do not fit"),
        ({"settling": 0.2}, "settling"),
        ({"prescaler": 3}, "prescaler"),
    ],
)
def test_impossible_settings_are_refused_before_the_board_is_asked(change, said):
    good = {"oversampling": 4, "settling": 2e-3, "current_limit": 0.1, "adc_bits": 10}
    with pytest.raises(SourceError, match=said):
        ScanSettings(**(good | change))


def test_timing_can_be_changed(clock):
    board = ScriptedBoard(clock)
    board.answer = lambda _: []
    settings = ScanSettings(oversampling=1, settling=0, current_limit=0.1, adc_bits=10)
    link = Link(board, SCAN, settings, timing=Timing(answer=1.0, tries=2), clock=clock.now)
    with pytest.raises(SourceError, match="after 2 tries"):
        link.connect()
    assert clock.time == pytest.approx(1002.0)
