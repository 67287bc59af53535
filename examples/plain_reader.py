"""Frames by nothing but pyserial and docs/protocol.md: python plain_reader.py PORT."""

import struct
import sys
from binascii import crc_hqx
from itertools import islice

import serial


def send(port, payload):
    """COBS(payload and checksum), then a zero."""
    data = payload + crc_hqx(payload, 0xFFFF).to_bytes(2, "big")
    port.write(b"".join(bytes([len(run) + 1]) + run for run in data.split(b"\0")) + b"\0")


def payloads(port):
    """Whatever arrives whole."""
    while True:
        got = port.read_until(b"\0")
        if not got:
            sys.exit("nothing has come for 5 s: check the board's power and cable")
        block, data = got[:-1], b""
        while block:
            code, run, block = block[0], block[1 : block[0]], block[block[0] :]
            data += run + (b"\0" if block and code < 255 else b"")
        if len(data) > 2 and crc_hqx(data, 0xFFFF) == 0:
            if data[0] == 0x04:  # FAULT: no frame comes until it is set up again
                sys.exit(f"the board has switched its current off: fault {data[9]}")
            yield data[:-2]


def frames(port, electrodes=8):
    """(sequence, ticks, counts) of adjacent drives, every electrode read but the driven two."""
    heard = payloads(port)
    next(p for p in heard if p[0] == 0x01)  # HELLO: nothing may be sent before it
    commands = [struct.pack("<BxHHIHBBI", 0x85, 1, electrodes, 2000, 2, 4, 64, 100_000)]
    for k in range(electrodes):
        source, mask = (k + 1) % electrodes, 2**electrodes - 1
        drive = struct.pack("<BBI", source, k, mask & ~(1 << k | 1 << source))
        commands.append(struct.pack("<BxHH", 0x86, 1, k) + drive)
    commands.append(struct.pack("<BxH", 0x87, 1))
    for request, command in enumerate(commands, 1):
        send(port, bytes([command[0], request]) + command[2:])
        ack = next(p for p in heard if p[0] == 0x03)
        assert ack[3] == 0, f"refused: {ack.hex()}"
    for number, payload in enumerate(p for p in heard if p[0] == 0x10):
        if number % 10 == 0:
            send(port, b"\x82\xff")  # PING: two seconds without, and the current goes off
        yield (
            *struct.unpack_from("<IQ", payload, 1),
            struct.unpack_from(f"<{(len(payload) - 18) // 2}H", payload, 18),
        )


if __name__ == "__main__":
    with serial.Serial(sys.argv[1], 1_000_000, timeout=5) as board:
        for sequence, ticks, counts in islice(frames(board), 100):
            print(sequence, f"{ticks / 250e3:.4f} s", *counts)
        send(board, b"\x83\xfe")  # STOP
