"""A Mega 2560 on a pty as avrdude and a host meet it: its bootloader (STK500v2), and a firmware.

The bootloader reads EEPROMs from twice the address, as that of most boards does.
"""

from __future__ import annotations

import os
import pty
import struct
import threading
import tty
from dataclasses import replace

from tomoskin.board.wire import encode
from tomoskin.twin import Board

SIGNATURE = b"\x1e\x98\x01"
SIGN_ON, SET, GET, ADDRESS, ENTER, LEAVE = 0x01, 0x02, 0x03, 0x06, 0x10, 0x11
PROGRAM_FLASH, READ_FLASH, PROGRAM_EEPROM, READ_EEPROM, SIGNED = 0x13, 0x14, 0x15, 0x16, 0x1B
START = 0x1B
NAME = b"Arduino Mega 2560"


class Mega:
    """``eeprom`` and ``flash`` are what was written; the oldest ones do not write EEPROMs."""

    def __init__(self, *, oldest=False):
        self.eeprom, self.flash = bytearray(b"\xff" * 4096), {}
        self._oldest = oldest
        self._line, self._terminal = pty.openpty()
        tty.setraw(self._terminal)
        self.port = os.ttyname(self._terminal)
        self._address = 0
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def close(self):
        os.close(self._terminal)
        self._thread.join()
        os.close(self._line)

    def _serve(self):
        waiting = b""
        while True:
            try:
                waiting += os.read(self._line, 4096)
            except OSError:  # the last one who had it open has gone
                return
            while waiting:
                waiting, answer = self._take(waiting)
                if answer is None:
                    break
                os.write(self._line, answer)

    def _take(self, waiting):
        """What is left, and the answer to what was whole; None where nothing was."""
        if waiting[0] == START:
            size = 6 + int.from_bytes(waiting[2:4], "big")
            if len(waiting) < max(size, 6):
                return waiting, None
            answer = self._boot(waiting[5 : size - 1])
            return waiting[size:], _framed(waiting[1], answer)
        _, end, rest = waiting.partition(b"\0")
        if not end:
            return waiting, None
        return rest, self._info()

    def _boot(self, body):
        command = body[0]
        done = bytes((command, 0))
        if command == SIGN_ON:
            return done + b"\x08AVRISP_2"
        if command == GET:
            return done + b"\x02"
        if command == SIGNED:
            return done + SIGNATURE[body[4] : body[4] + 1] + b"\0"
        if command == ADDRESS:
            self._address = int.from_bytes(body[1:5], "big") & 0x7FFFFFFF
        elif command in (PROGRAM_FLASH, PROGRAM_EEPROM):
            self._program(command, body[10:])
        elif command in (READ_FLASH, READ_EEPROM):
            return done + self._read(command, int.from_bytes(body[1:3], "big")) + b"\0"
        return done

    def _program(self, command, data):
        if command == PROGRAM_FLASH:
            self.flash |= {2 * self._address + n: byte for n, byte in enumerate(data)}
        elif not self._oldest:
            self.eeprom[self._address : self._address + len(data)] = data

    def _read(self, command, size):
        if command == READ_EEPROM:
            return bytes(self.eeprom[2 * self._address : 2 * self._address + size])
        return bytes(self.flash.get(2 * self._address + n, 0xFF) for n in range(size))

    def _info(self):
        current, unique_id = struct.unpack_from("<I8s", self.eeprom)
        board = Board(8, 10, 0.1, 250e3, 128, 400, unique_id=unique_id)
        info = replace(board.info(1), current=100_000 if current == 2**32 - 1 else current)
        return encode(info) + encode(replace(board.limits, name=NAME.ljust(24, b"\0")))


def _framed(number, body):
    message = bytes((START, number)) + len(body).to_bytes(2, "big") + b"\x0e" + body
    check = 0
    for byte in message:
        check ^= byte
    return message + bytes((check,))
