"""The twin's firmware: bytes and the time in, bytes out. No I/O, no waiting."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.board import wire
from tomoskin.core import Frame
from tomoskin.twin.held_scanning import OK, Board, HeldScanning, Question, Setting, Verdict
from tomoskin.twin.scanning import Analogue, SampleTable, ScanClock, chopped_table, sample_table

_HELLO_INTERVAL = 0.5
_HEARTBEAT = 2.0
_HEARTBEAT_MS = (100, 10_000)


@dataclass
class _Scanning:
    """A scan under way: ``due`` is when the next frame is whole, ``device_time`` its start."""

    table: SampleTable
    configuration: int
    period: float
    due: float
    device_time: float
    sequence: int = 0


class TwinDevice:
    """Behaves on the wire as the board does.

    Says HELLO until spoken to, answers, scans when told to, and switches its current off on STOP
    and on host silence.
    """

    def __init__(self, analogue: Analogue, board: Board, now: float, pace: float = 1.0) -> None:
        """Power on at ``now`` s. ``pace``: seconds per second of device time; 0: no waiting."""
        self._analogue, self._board, self._pace = analogue, board, pace
        self._out = bytearray()
        self.reboot(now)

    def reboot(self, now: float) -> None:
        """Power off and on: what was set, scanned or still to be sent is gone."""
        self._out.clear()
        self._deframer = wire.Deframer(wire.SCHEMA.to_device_bytes)
        self._power_on = self._heard = now
        self._next_hello: float | None = now
        self._heartbeat = _HEARTBEAT
        self._held = HeldScanning(self._board)
        self._scanning: _Scanning | None = None
        self._last: tuple[int, int] | None = None
        self._last_reply = b""

    @property
    def driving(self) -> bool:
        """Whether current flows; otherwise every channel is high-impedance."""
        return self._scanning is not None

    @property
    def due(self) -> float:
        """When something will be sent next, unless a command comes first."""
        times = [self._heard + self._heartbeat if self._next_hello is None else self._next_hello]
        if self._scanning:
            times.append(self._scanning.due)
        return times[0] if len(times) == 1 else min(times)

    def receive(self, data: bytes, now: float) -> None:
        """Act on bytes from the host; answers come with the next :meth:`emit`."""
        for payload in self._deframer.feed(data):
            if len(payload) < 2:
                continue
            message = wire.decode_payload(payload, now)
            if message is None or not wire.is_command(message):
                self._refuse(payload)
            else:
                self._obey(message, payload, now)

    def emit(self, now: float) -> bytes:
        """What is to be sent by ``now``: answers, HELLO, at most one frame."""
        if self._next_hello is None and now >= self._heard + self._heartbeat:
            self._fall_silent(now)
        if self._next_hello is not None and now >= self._next_hello:
            self._say(wire.Hello(wire.SCHEMA.major, wire.SCHEMA.minor, wire.SCHEMA.hash))
            self._next_hello = max(self._next_hello + _HELLO_INTERVAL, now)
        if self._scanning and now >= self._scanning.due:
            frame = self._frame(self._scanning, now)
            self._out += wire.encode(frame, packed=self._held.format is wire.Format.PACKED)
        data = bytes(self._out)
        self._out.clear()
        return data

    def _frame(self, scanning: _Scanning, now: float) -> Frame:
        counts = self._analogue.sample(scanning.table, scanning.device_time)
        samples, sums = scanning.table.readings(counts)
        frame = Frame(
            sequence=scanning.sequence,
            ticks=round(scanning.device_time * self._board.tick_rate),
            host_time=now,
            configuration=scanning.configuration,
            flags=int(wire.FrameFlag.FIRST) if scanning.sequence == 0 else 0,
            drops=0,
            samples=samples,
            sums=sums,
        )
        # A computer that is too slow for the scan makes the twin scan later, never skip.
        next_due = scanning.due + scanning.period * self._pace
        slip = max(0.0, now - next_due)
        scanning.due = next_due + slip
        scanning.device_time += scanning.period + slip * self._pace
        scanning.sequence = (scanning.sequence + 1) % 2**32
        return frame

    def _fall_silent(self, now: float) -> None:
        if self._scanning:
            ticks = round((now - self._power_on) * self._board.tick_rate)
            self._say(wire.Fault(ticks, wire.FaultCode.HOST_SILENT, 0))
        self._scanning = None
        self._last = None
        self._next_hello = now

    def _refuse(self, payload: bytes) -> None:
        commands = {message.type for message in wire.SCHEMA.messages if message.to_device}
        result = wire.Result.BAD_LENGTH if payload[0] in commands else wire.Result.UNKNOWN_COMMAND
        self._say(wire.Ack(payload[1], payload[0], result, 0))

    def _obey(self, command: wire.Command, payload: bytes, now: float) -> None:
        self._heard, self._next_hello = now, None
        identity = (command.request, wire.crc16(payload))
        if isinstance(command, Question):
            self._last_reply = wire.encode(self._held.answer(command))
        elif identity != self._last:
            result, detail = self._run(command, now)
            self._last_reply = wire.encode(wire.Ack(command.request, payload[0], result, detail))
        self._last = identity
        self._out += self._last_reply

    def _run(self, command: wire.Command, now: float) -> Verdict:
        if self._scanning and isinstance(command, Setting | wire.Start | wire.SetBaud):
            return wire.Result.BUSY, 0
        if isinstance(command, Setting):
            return self._held.set(command)
        match command:
            case wire.Stop():
                self._scanning = None
            case wire.SafeOff():
                self._scanning = None
                self._held = HeldScanning(self._board)
            case wire.SetHeartbeat():
                low, high = _HEARTBEAT_MS
                if not low <= command.interval <= high:
                    return wire.Result.BAD_VALUE, 1
                self._heartbeat = command.interval / 1e3
            case wire.Start():
                return self._start(command, now)
            case _:
                pass
        return OK

    def _start(self, command: wire.Start, now: float) -> Verdict:
        held = self._held
        verdict = self._board.check_start(command.configuration, held.scan, held.drives, held.mode)
        if verdict != OK or held.scan is None:
            return verdict
        scan, drives = held.scan, [drive for drive in held.drives if drive]
        converter, mode = self._board.converter, held.mode
        times = ScanClock(
            scan.dead_time * 1e-6,
            scan.settling * 1e-6,
            converter.conversion(scan.prescaler),
            dropped=converter.dropped,
        )
        if mode is None:
            table = sample_table(drives, scan.oversampling, times)
        else:
            table = chopped_table(drives, scan.oversampling, times, mode.frequency, mode.periods)
        period = table.seconds
        self._scanning = _Scanning(
            table, scan.configuration, period, now + period * self._pace, now - self._power_on
        )
        return OK

    def _say(self, message: wire.Hello | wire.Fault | wire.Ack) -> None:
        self._out += wire.encode(message)
