// A board on a watched machine, and what a host says to it.
#pragma once

#include "machine.h"

#include <gtest/gtest.h>

inline uint32_t u32_at(const Bytes &b, size_t at) {
    return static_cast<uint32_t>(b[at] | b[at + 1] << 8 | b[at + 2] << 16) |
           static_cast<uint32_t>(b[at + 3]) << 24;
}
inline unsigned u16_at(const Bytes &b, size_t at) { return b[at] | static_cast<unsigned>(b[at + 1]) << 8; }
inline uint8_t low(unsigned value) { return static_cast<uint8_t>(value & 0xFF); }
inline uint8_t high(unsigned value) { return static_cast<uint8_t>(value >> 8 & 0xFF); }

struct Drive {
    uint8_t source, sink;
    uint16_t mask;
};

class Board : public testing::Test {
  protected:
    static constexpr int kElectrodes = 8;
    unsigned settling = 200, dead = 5, oversampling = 4;
    std::vector<Drive> drives;
    uint8_t request = 0;

    void SetUp() override {
        machine = Machine{};
        machine.power_on();
        for (int k = 0; k < kElectrodes; k++) {
            auto source = static_cast<uint8_t>((k + 1) % kElectrodes);
            auto sink = static_cast<uint8_t>(k);
            drives.push_back({source, sink, static_cast<uint16_t>(0xFF & ~(1 << source | 1 << sink))});
        }
    }

    void TearDown() override { EXPECT_EQ(machine.wrongs, std::vector<std::string>{}); }

    // The messages of a type among what was sent.
    static std::vector<Bytes> of(uint8_t type, const std::vector<Bytes> &all) {
        std::vector<Bytes> found;
        for (const Bytes &payload : all) {
            if (!payload.empty() && payload[0] == type) {
                found.push_back(payload);
            }
        }
        return found;
    }

    unsigned ask(Bytes payload) {
        payload.insert(payload.begin() + 1, ++request);
        machine.say(payload);
        machine.run_us(200);
        auto all = machine.heard();
        auto acks = of(MSG_ACK, all);
        meanwhile.insert(meanwhile.end(), all.begin(), all.end());
        EXPECT_EQ(acks.size(), 1u);
        if (acks.empty()) {
            return 999;
        }
        EXPECT_EQ(acks[0][AT_ACK_REQUEST], request);
        EXPECT_EQ(acks[0][AT_ACK_COMMAND], payload[0]);
        detail = u16_at(acks[0], AT_ACK_DETAIL);
        return acks[0][AT_ACK_RESULT];
    }
    unsigned detail = 0;
    std::vector<Bytes> meanwhile;  // what came with the answers

    unsigned set_scan(unsigned n_drives, uint32_t limit = 100'000) {
        machine.dead_ns = dead * uint64_t{1000};
        return ask({MSG_SET_SCAN, 5, 0, low(n_drives), high(n_drives), low(settling), high(settling),
                    low(settling >> 16), 0, low(dead), high(dead), low(oversampling), 64, low(limit),
                    high(limit), low(limit >> 16), high(limit >> 16)});
    }
    unsigned set_drive(unsigned number, Drive d) {
        return ask({MSG_SET_PATTERN, 5, 0, low(number), high(number), d.source, d.sink, low(d.mask),
                    high(d.mask), 0, 0});
    }
    unsigned set_format(uint8_t format) { return ask({MSG_SET_FORMAT, 5, 0, format}); }
    unsigned start() { return ask({MSG_START, 5, 0}); }
    void set_up() {
        ASSERT_EQ(set_scan(static_cast<unsigned>(drives.size())), RESULT_OK);
        for (unsigned k = 0; k < drives.size(); k++) {
            ASSERT_EQ(set_drive(k, drives[k]), RESULT_OK);
        }
    }
    void scan() {
        set_up();
        ASSERT_EQ(start(), RESULT_OK);
    }
    void expect_off() {
        EXPECT_EQ(machine.source, -1);
        size_t moves = machine.events.size();
        machine.hang_us(1'000'000);
        for (size_t k = moves; k < machine.events.size(); k++) {
            EXPECT_EQ(machine.events[k].move, Machine::Move::kDisable);
        }
    }
    void expect_fault(uint8_t code, unsigned what) {
        auto faults = of(MSG_FAULT, machine.heard());
        ASSERT_EQ(faults.size(), 1u);
        EXPECT_EQ(faults[0][AT_FAULT_CODE], code);
        EXPECT_EQ(u16_at(faults[0], AT_FAULT_DETAIL), what);
    }
    std::vector<unsigned> expected() const {
        std::vector<unsigned> samples;
        for (const Drive &d : drives) {
            for (int e = 0; e < 16; e++) {
                if (d.mask >> e & 1) {
                    samples.push_back(oversampling * code_of(d.source, d.sink, e));
                }
            }
        }
        return samples;
    }
    void expect_frames(const std::vector<Bytes> &frames) {
        auto wanted = expected();
        for (size_t k = 0; k < frames.size(); k++) {
            ASSERT_EQ(frames[k].size(), SIZE_FRAME + 2 * wanted.size());
            EXPECT_EQ(u32_at(frames[k], AT_FRAME_SEQUENCE), k);
            EXPECT_EQ(u16_at(frames[k], AT_FRAME_CONFIGURATION), 5u);
            EXPECT_EQ(frames[k][AT_FRAME_FLAGS], k == 0 ? FLAG_FIRST : 0u);
            for (size_t s = 0; s < wanted.size(); s++) {
                ASSERT_EQ(u16_at(frames[k], SIZE_FRAME + 2 * s), wanted[s]) << "sample " << s;
            }
        }
    }
};
