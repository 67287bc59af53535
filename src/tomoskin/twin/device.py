"""The twin's firmware: bytes and the time in, bytes out. No I/O, no waiting."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.board import wire
from tomoskin.core import DriveSamples, Frame
from tomoskin.twin.held_scanning import OK, PACKED, Board, HeldScanning, Question, Setting, Verdict
from tomoskin.twin.scanning import Analogue, SampleTable, ScanClock, chopped_table, sample_table

_HELLO_INTERVAL = 0.5
_HEARTBEAT = 2.0
_HEARTBEAT_MS = (100, 10_000)


@dataclass
class _Scanning:
    """A scan under way.

    ``due`` is when what is sent next has been read, ``device_time`` the start of its turn. Where
    drives are sent ``singly``, ``elapsed`` s of the turn are over, and ``order`` and the drives of
    it are those of this turn; what was ``asked`` for is scanned next.
    """

    table: SampleTable
    singly: bool
    configuration: int
    due: float
    device_time: float
    sequence: int = 0
    order: int = 0
    drives: bytes = b""
    asked: wire.SetOrder | None = None
    place: int = 0
    elapsed: float = 0.0

    @property
    def drive(self) -> int:
        """The drive that is under way."""
        return self.drives[self.place] if self.order else self.place

    @property
    def part(self) -> SampleTable:
        """What is sent next: the whole scan, or a drive."""
        return self.table.parts[self.drive] if self.singly else self.table

    def go_on(self) -> None:
        """The next drive, or the next turn."""
        self.elapsed += self.part.seconds
        self.place += 1
        count = len(self.drives) if self.order else len(self.table.parts)
        full = not self.order and self.place == count
        if self.singly and self.asked is None and self.place < count:
            return
        # a sum over drives would be as long, but for rounding
        self.device_time += self.table.seconds if full or not self.singly else self.elapsed
        self.sequence = (self.sequence + 1) % 2**32
        self.place, self.elapsed = 0, 0.0
        if self.asked is not None:
            self.order, self.drives, self.asked = self.asked.order, self.asked.drives, None


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
        """What is to be sent by ``now``: answers, HELLO, at most one frame or drive."""
        if self._next_hello is None and now >= self._heard + self._heartbeat:
            self._fall_silent(now)
        if self._next_hello is not None and now >= self._next_hello:
            self._say(wire.Hello(wire.SCHEMA.major, wire.SCHEMA.minor, wire.SCHEMA.hash))
            self._next_hello = max(self._next_hello + _HELLO_INTERVAL, now)
        if self._scanning and now >= self._scanning.due:
            samples = self._sample(self._scanning, now)
            self._out += wire.encode(samples, packed=self._held.format in PACKED)
        data = bytes(self._out)
        self._out.clear()
        return data

    def _sample(self, scanning: _Scanning, now: float) -> Frame | DriveSamples:
        part, time = scanning.part, scanning.device_time + scanning.elapsed
        samples, sums = part.readings(self._analogue.sample(part, time))
        ticks = round(time * self._board.tick_rate)
        flags = int(wire.FrameFlag.FIRST) if scanning.sequence == 0 else 0
        head = scanning.sequence, ticks, now, scanning.configuration, flags, 0
        sent: Frame | DriveSamples = Frame(*head, samples, sums)
        if scanning.singly:
            place = scanning.order, scanning.place, scanning.drive
            sent = DriveSamples(*head, *place, samples, sums)
        # A computer that is too slow for the scan makes the twin scan later, never skip.
        scanning.go_on()
        seconds = scanning.part.seconds
        next_due = scanning.due + seconds * self._pace
        slip = max(0.0, now - next_due)
        scanning.due = next_due + slip
        scanning.device_time += slip * self._pace
        return sent

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
            case wire.SetOrder():
                return self._reorder(command)
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

    def _reorder(self, command: wire.SetOrder) -> Verdict:
        scanning = self._scanning
        if scanning is None or not scanning.singly:
            return wire.Result.NOT_SINGLY, 0
        if command.configuration != scanning.configuration:
            return wire.Result.WRONG_CONFIGURATION, 0
        verdict = self._board.check_order(command, len(scanning.table.parts))
        newest = scanning.asked.order if scanning.asked else scanning.order
        if verdict == OK and command.order != newest:
            scanning.asked = command
        return verdict

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
        singly = held.format in (wire.Format.DRIVES, wire.Format.DRIVES_PACKED)
        device_time = now - self._power_on
        scanning = _Scanning(table, singly, scan.configuration, now, device_time)
        scanning.due += scanning.part.seconds * self._pace
        self._scanning = scanning
        return OK

    def _say(self, message: wire.Hello | wire.Fault | wire.Ack) -> None:
        self._out += wire.encode(message)
