// A machine for tests: time that a test lets pass, switches that are watched, a line of two queues.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

extern "C" {
#include "board.h"
#include "hal.h"
#include "limits.h"
#include "protocol.h"
#include "switches.h"
}

using Bytes = std::vector<uint8_t>;

struct Machine {
    enum class Move { kDisable, kAddress, kLatch, kEnable };
    struct Event {
        Move move;
        uint64_t ns;
        int source;
        int sink;
    };

    // What the firmware has done.
    std::vector<Event> events;
    std::vector<std::string> wrongs;  // broken rules, found as they are broken
    Bytes sent;
    uint32_t baud = 0;
    uint64_t kicked_ns = 0;
    uint64_t longest_on_ns = 0;

    // What the machine is.
    uint64_t ns = 0;
    uint32_t current = 100000;
    uint8_t reset_cause = RESET_POWER;
    uint64_t dead_ns = 0;  // that the host has asked for
    uint16_t room = 2000;  // bytes that the line takes in a round
    bool timer_works = true;
    bool converter_works = true;
    bool plugged_in = true;
    losses lost{0, 0};
    bool against_neighbour = false;

    int source = -1, sink = -1;  // connected now

    void power_on();
    // Interrupts as they are due, a round of the main loop after each and every `round_us`.
    void run_us(uint64_t us, uint64_t round_us = 100);
    // Interrupts only: the main loop hangs.
    void hang_us(uint64_t us);
    void say(const Bytes &payload);
    void say_raw(const Bytes &line);
    // Payloads with a right checksum that were sent since the last call.
    std::vector<Bytes> heard();

    uint64_t timer_ns = UINT64_MAX;
    uint64_t timer_set_ns = 0;
    uint64_t adc_ns = UINT64_MAX;
    uint64_t sample_ns = 0;
    uint8_t conversions = 0;
    int converted = 0;
    int latched_source = -1, latched_sink = -1;
    int address_source = -1, address_sink = -1;
    uint64_t disabled_ns = 0, enabled_ns = 0;
    std::deque<uint8_t> line;
    std::basic_string_view<uint8_t> sending;  // read as it goes, as by the board's interrupt
    bool locked = false;

    bool deliver(uint64_t until);
    void note(Move move, int a = -1, int b = -1);
};

extern Machine machine;

// What the fake converter reads: tells apart every drive and channel.
uint16_t code_of(int source, int sink, int channel);

// Byte-wise, written for these tests from docs/protocol.md: no code is shared with the firmware.
Bytes enclose(Bytes payload);
uint16_t slow_crc(const Bytes &data);
