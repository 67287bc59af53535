"""What the protocol can measure of a board with a ring of known resistors in place of the skin."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tomoskin.board import source, wire
from tomoskin.core import FloatArray, Frame, SourceError
from tomoskin.model.pattern import Scan
from tomoskin.sensing.signal import CountScale, LoadRing, diagnose

BITS = source.BOARDS[source.DEFAULT_BOARD].adc_bits
"""Of a count here: the samples of a finer converter are scaled to it."""

_NOISE = 2.0
"""Counts a conversion; the decks give 0.7, and rounding adds 0.3."""

_EARLY, _LATE = 120e-6, 2e-3
"""Settling times that must give the same readings, s; the decks need up to 116 µs."""

_UNSETTLED = 2.0
"""Counts between the two."""

_SINK_OHMS = 0.3
"""Ω from an electrode to ground: a transistor of 0.03 Ω, tracks, joints."""

_AT_ONCE = source.Timing(hello=0.05)
"""Of a board that has spoken before."""


@dataclass(frozen=True, slots=True)
class CheckFinding:
    """What was looked at: whether it is as expected, a sentence; ``optional``: it need not be."""

    name: str
    ok: bool
    text: str
    optional: bool = False

    @property
    def mark(self) -> str:
        """The word that stands before the finding on a terminal."""
        if self.ok:
            return "ok"
        return "-" if self.optional else "FAIL"


@dataclass(frozen=True, eq=False)
class _Readings:
    """(n_drives, n) mean and standard deviation of one conversion, counts; who answered."""

    mean: FloatArray
    sd: FloatArray
    info: wire.Info
    board: wire.BoardLimits | None

    @property
    def record(self) -> source.BoardRecord:
        """What is known of such a board; of an unknown one, what is known of the first."""
        known = source.board_named(self.board.text) if self.board else None
        return known or source.BOARDS[source.DEFAULT_BOARD]


def check_board(
    transport: source.Transport,
    ring: LoadRing,
    current: float,
    *,
    five_volts: float | None = None,
    frames: int = 24,
) -> Iterator[CheckFinding]:
    """Look at a board whose terminals hold ``ring``, set to ``current`` A.

    ``frames`` are averaged for each pass. Findings come as they are made. ``five_volts`` is what a
    meter shows at +5V. It is the reference of a converter that has none of its own; where it is not
    known, the current is only known as well as USB's 5 V are.

    Raises
    ------
    SourceError
        When no board answers, it refuses the scan, or goes away.
    """
    n = len(ring.ohms)
    onward, back = ring.scans()
    settings = source.ScanSettings(4, _LATE, current, BITS)
    first = _measure(transport, onward, settings, frames, source.Timing())
    yield _identity(first, n, current)
    yield from _differences(first)
    second = _measure(transport, back, settings, frames, _AT_ONCE)
    record = first.record
    guessed = record.usb_reference and five_volts is None
    reference = record.reference
    if record.usb_reference and five_volts is not None:
        reference = five_volts
    scale = CountScale.of(record.gain, reference, BITS, measured=not guessed)
    board = diagnose(
        np.vstack([first.mean, second.mean]),
        ring,
        np.vstack([onward.drives, back.drives]),
        current,
        scale,
    )
    for text in board.faults:
        yield CheckFinding("channels", False, text)
    if not board.faults:
        text = (
            f"{n} channels as source, sink and reading: deviations of {board.deviation:.1f} counts "
            f"(RMS), at most {board.largest:.1f}"
        )
        yield CheckFinding("channels", True, text)
        text = f"{board.scale * current * 1e3:.4g} mA through resistors of their nominal values"
        text += ", if +5V is 5.00 V: --five-volts says what a meter shows there" * guessed
        yield CheckFinding("current", True, text)
        ok = board.sink_ohms < _SINK_OHMS
        text = f"{board.sink_ohms * 1e3:.0f} mΩ from a sink to ground"
        yield CheckFinding("sinks", ok, text if ok else f"{text}: solder joints, Q103, Q203, …")
    yield _noise(np.vstack([first.sd, second.sd]))
    early = _measure(transport, onward, replace(settings, settling=_EARLY), frames, _AT_ONCE)
    yield _settling(early, first)
    yield from check_safe_off(transport, onward, settings)


def _measure(
    transport: source.Transport,
    scan: Scan,
    settings: source.ScanSettings,
    frames: int,
    timing: source.Timing,
) -> _Readings:
    """Mean and noise over ``frames``; the board is stopped, the transport stays open."""
    link = source.Link(transport, scan, settings, timing=timing)
    got: list[np.ndarray] = []
    info = link.connect()
    end = time.monotonic() + _PATIENCE
    try:
        while len(got) <= frames:
            if time.monotonic() > end:
                raise SourceError(
                    f"expected {frames} frames within {_PATIENCE:.0f} s, got {len(got)}",
                    where=transport.name,
                    hint="check the cable; tomoskin record shows how many frames are lost",
                )
            items = link.poll(0.1)
            got += [item.samples for item in items if isinstance(item, Frame)]
    finally:
        link.stop()
    samples = np.array(got[1:], dtype=float)
    shape = scan.drives.shape[0], -1
    mean = samples.mean(axis=0).reshape(shape) / settings.oversampling
    sd = samples.std(axis=0, ddof=1).reshape(shape) / np.sqrt(settings.oversampling)
    return _Readings(mean, sd, info, link.session.board)


_PATIENCE = 60.0


def _identity(readings: _Readings, n: int, current: float) -> CheckFinding:
    """Whether the firmware is of a board like this."""
    info = readings.info
    firmware = ".".join(map(str, info.firmware))
    said = f"firmware {firmware}, {info.channels} channels, {info.current / 1e3:g} mA"
    said = f"{readings.board.text}, {said}" if readings.board else said
    if info.channels < n:
        return CheckFinding(
            "handshake",
            False,
            f"{said}: expected {n} channels; flash the firmware for {n} channels",
        )
    if info.current != round(current * 1e6):
        hint = f'but expected {current * 1e3:g} mA: tomoskin firmware configure PORT --current "…"'
        return CheckFinding("handshake", False, f"{said}, {hint}")
    return CheckFinding("handshake", True, said)


def _differences(readings: _Readings) -> Iterator[CheckFinding]:
    """What a known board says of itself against its record; what it says counts."""
    info, board, record = readings.info, readings.board, readings.record
    if board is None or board.text != record.text:
        return
    said = {name: getattr(info, name) for name in ("adc_bits", "max_samples", "tick_rate")}
    said |= {name: getattr(board, name) for name in ("min_chop", "max_chop", "clock")}
    known = {name: getattr(record, name, getattr(record.chop, name, None)) for name in said}
    different = [name for name in said if said[name] != known[name]]
    if different:
        text = ", ".join(f"{name} {said[name]} instead of {known[name]:g}" for name in different)
        yield CheckFinding(
            "record",
            False,
            f"the firmware is another than the one known here of the {record.text}: {text}",
        )


def _noise(sd: FloatArray) -> CheckFinding:
    by_channel = np.sqrt(np.mean(sd**2, axis=0))
    worst = int(by_channel.argmax())
    text = f"{np.median(by_channel):.2f} counts a conversion, "
    text += f"most on E{worst + 1} ({by_channel[worst]:.2f})"
    ok = bool(by_channel[worst] < _NOISE)
    look = f"; expected less than {_NOISE:g}: C{100 * (worst + 1) + 3}, its supply, a long cable"
    return CheckFinding("noise", ok, text if ok else text + look)


def _settling(early: _Readings, late: _Readings) -> CheckFinding:
    off = np.abs(early.mean - late.mean).max(axis=0)
    worst = int(off.argmax())
    text = f"after {_EARLY * 1e6:.0f} µs within {off[worst]:.1f} counts of the value after 2 ms"
    ok = bool(off[worst] < _UNSETTLED)
    look = f"; on E{worst + 1}: C{100 * (worst + 1) + 1}, C{100 * (worst + 1) + 3}"
    return CheckFinding("settling", ok, text if ok else text + look)


_ANSWER, _TRIES = 0.3, 5
_HEARTBEAT, _USUAL = 300, 2000
"""ms of silence that the board tolerates: while this is tried, and after reset."""

_HEARD = 10.0
"""s until the board must have said that it stopped; an emulator's clock may be far behind."""


def check_safe_off(
    transport: source.Transport, scan: Scan, settings: source.ScanSettings
) -> Iterator[CheckFinding]:
    """STOP, a silent host, SAFE_OFF: frames end, and nothing starts again by itself.

    Frames stand for the current here, since only a drive is sampled; whether a switch really opens
    is what the channels' readings and the multimeter say. Raises SourceError without an answer.
    """
    board = source.Exchange(transport)
    configuration = source.Configuration.of(scan, settings)
    set_up: tuple[wire.Command, ...] = (
        configuration.scan,
        *configuration.patterns,
        wire.SetHeartbeat(0, _HEARTBEAT),
    )
    start = wire.Start(0, configuration.identity)
    _asked(board, wire.Stop(0))
    for command in set_up:
        _accepted(_asked(board, command), command, transport)
    _accepted(_asked(board, start), start, transport)
    _asked(board, wire.Stop(0))
    late = any(isinstance(m, Frame) for m in board.listen(4 * configuration.scan_time))
    text = "frames continue after STOP" if late else "no frame after STOP"
    yield CheckFinding("stop", not late, text)
    _accepted(_asked(board, start), start, transport)
    heard = board.listen(_HEARD)
    silent = any(isinstance(m, wire.Fault) and m.code is wire.FaultCode.HOST_SILENT for m in heard)
    since = f"{_HEARTBEAT} ms after the last message of the host"
    text = f"no frame {since}" if silent else f"frames continue {since}"
    yield CheckFinding("silence", silent, text)
    _asked(board, wire.SetHeartbeat(0, _USUAL))
    _asked(board, wire.SafeOff(0))
    forgotten = _asked(board, start).result is wire.Result.WRONG_CONFIGURATION
    _asked(board, wire.Stop(0))
    text = "nothing starts after SAFE_OFF until the board is set up again"
    text = text if forgotten else "START is accepted after SAFE_OFF"
    yield CheckFinding("safe off", forgotten, text)


def _asked(board: source.Exchange, command: wire.Command) -> wire.Ack:
    answer = board.ask(command, wire.Ack, patience=_ANSWER, tries=_TRIES)
    if answer is None:
        raise SourceError(
            f"no answer to {type(command).__name__} for {_ANSWER * _TRIES:g} s",
            where=board.transport.name,
            hint="start the check again; a board that often stops answering may have a weak supply",
        )
    return answer


def _accepted(answer: wire.Ack, command: wire.Command, transport: source.Transport) -> None:
    if answer.result is not wire.Result.OK:
        raise SourceError(
            f"the board refused {type(command).__name__}: {answer.result.name} ({answer.detail})",
            where=transport.name,
        )
