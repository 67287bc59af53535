// The alternating drive on a watched machine: values, both directions, limits, safety.
#include "fixture.h"

#include <cmath>
#include <map>

namespace {

class Chopped : public Board {
  protected:
    unsigned frequency = 500, periods = 2;

    unsigned set_mode(unsigned mode, unsigned hertz, unsigned count) {
        return ask({MSG_SET_MODE, 5, 0, low(mode), low(hertz), high(hertz), low(count)});
    }
    void scan_chopped() {
        set_up();
        ASSERT_EQ(set_mode(DRIVE_MODE_CHOPPED, frequency, periods), RESULT_OK);
        ASSERT_EQ(start(), RESULT_OK);
    }
    // Difference and sum of each sample: worked out here by another way than the board's.
    std::vector<unsigned> pairs() const {
        std::vector<unsigned> values;
        int half = static_cast<int>(oversampling) / 2;
        for (const Drive &d : drives) {
            for (int e = 0; e < 16; e++) {
                if (d.mask >> e & 1) {
                    int ahead = half * code_of(d.source, d.sink, e);
                    int back = half * code_of(d.sink, d.source, e);
                    values.push_back(static_cast<unsigned>(ahead - back + 32768));
                    values.push_back(static_cast<unsigned>(ahead + back));
                }
            }
        }
        return values;
    }
    // Where the current flows, in the next `us` ones, until `reversed`; false: it never does.
    bool run_until(bool reversed) {
        for (int k = 0; k < 20'000; k++) {
            machine.run_us(10, 10);
            if (machine.source >= 0 && (machine.sink == (machine.source + 1) % 8) == reversed) {
                return true;
            }
        }
        return false;
    }
};

TEST_F(Chopped, FramesHoldDifferencesAndSums) {
    for (unsigned count : {1u, 2u}) {
        SCOPED_TRACE(count);
        machine.power_on();
        periods = count;
        scan_chopped();
        machine.run_us(300'000);
        auto all = machine.heard();
        EXPECT_TRUE(of(MSG_FRAME, all).empty());
        auto frames = of(MSG_FRAME_CHOPPED, all);
        ASSERT_GT(frames.size(), 5u);
        auto wanted = pairs();
        for (size_t k = 0; k < frames.size(); k++) {
            EXPECT_EQ(u32_at(frames[k], AT_FRAME_CHOPPED_SEQUENCE), k);
            ASSERT_EQ(frames[k].size(), SIZE_FRAME_CHOPPED + 2 * wanted.size());
            for (size_t v = 0; v < wanted.size(); v++) {
                ASSERT_EQ(u16_at(frames[k], SIZE_FRAME_CHOPPED + 2 * v), wanted[v]) << "value " << v;
            }
        }
    }
}

TEST_F(Chopped, ADriveThatWouldDriveItsReferenceWhenTurnedIsRefused) {
    machine.against_neighbour = true;
    set_up();
    EXPECT_EQ(start(), RESULT_OK);  // in one direction neighbours can be read
    EXPECT_EQ(ask({MSG_STOP}), RESULT_OK);
    ASSERT_EQ(set_mode(DRIVE_MODE_CHOPPED, frequency, periods), RESULT_OK);
    EXPECT_EQ(start(), RESULT_DRIVEN_REFERENCE);
    EXPECT_EQ(detail, 0u);
    for (uint8_t k = 0; k < kElectrodes; k++) {
        drives[k].source = static_cast<uint8_t>((k + 2) % kElectrodes);  // one is between them
    }
    scan_chopped();
}

TEST_F(Chopped, TheLargestSumsFit) {
    oversampling = 64;
    frequency = 15;
    periods = 1;
    drives = {{1, 0, 0xFFFF}, {15, 14, 0x00FF}};
    scan_chopped();
    machine.run_us(500'000);
    auto frames = of(MSG_FRAME_CHOPPED, machine.heard());
    ASSERT_GE(frames.size(), 2u);
    auto wanted = pairs();
    for (size_t v = 0; v < wanted.size(); v++) {
        ASSERT_EQ(u16_at(frames[1], SIZE_FRAME_CHOPPED + 2 * v), wanted[v]) << "value " << v;
    }
}

TEST_F(Chopped, EachDirectionIsOnForAsLongAndAsOften) {
    scan_chopped();
    machine.run_us(100'000);
    std::map<std::pair<int, int>, std::pair<int, uint64_t>> on;  // times, ns
    const Machine::Event *began = nullptr;
    std::vector<uint64_t> starts;
    for (const auto &event : machine.events) {
        if (event.move == Machine::Move::kEnable) {
            began = &event;
            starts.push_back(event.ns);
        } else if (event.move == Machine::Move::kDisable && began != nullptr) {
            auto &[times, ns] = on[{began->source, began->sink}];
            times++;
            ns += event.ns - began->ns;
            began = nullptr;
        }
    }
    for (const Drive &d : drives) {
        auto [times, ns] = on[{d.source, d.sink}];
        auto [times_back, ns_back] = on[{d.sink, d.source}];
        ASSERT_GT(times, 3);
        EXPECT_LE(std::abs(times - times_back), 1);
        EXPECT_NEAR(double(ns) / times, double(ns_back) / times_back, 4100) << int(d.source);
    }
    double half = double(starts.back() - starts.front()) / double(starts.size() - 1);
    EXPECT_NEAR(half, 1e9 / (2 * frequency), 0.02 * half);
    EXPECT_LE(machine.longest_on_ns, 1e9 / (2 * frequency));
}

TEST_F(Chopped, DeadTimesOfAllLengths) {
    for (unsigned us : {0u, 50u, 51u, 300u}) {
        SCOPED_TRACE(us);
        machine.power_on();
        dead = us;
        scan_chopped();
        machine.run_us(200'000);
        EXPECT_GE(of(MSG_FRAME_CHOPPED, machine.heard()).size(), 2u);
        EXPECT_EQ(machine.wrongs, std::vector<std::string>{});
    }
}

TEST_F(Chopped, StopAndSafeOffSwitchOffInBothDirections) {
    for (bool reversed : {false, true}) {
        for (auto command : {uint8_t{MSG_STOP}, uint8_t{MSG_SAFE_OFF}}) {
            SCOPED_TRACE(reversed);
            machine.power_on();
            scan_chopped();
            ASSERT_TRUE(run_until(reversed));
            EXPECT_EQ(ask({command}), RESULT_OK);
            expect_off();
        }
    }
}

TEST_F(Chopped, APulledPlugSwitchesOffInBothDirections) {
    for (bool reversed : {false, true}) {
        machine.power_on();
        scan_chopped();
        ASSERT_TRUE(run_until(reversed));
        machine.plugged_in = false;
        machine.run_us(100);
        EXPECT_EQ(machine.source, -1);
        expect_off();
    }
}

TEST_F(Chopped, HostSilenceSwitchesOff) {
    scan_chopped();
    machine.run_us(2'010'000, 1000);
    auto faults = of(MSG_FAULT, machine.heard());
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0][AT_FAULT_CODE], FAULT_HOST_SILENT);
    expect_off();
}

TEST_F(Chopped, WhatHangsIsAFaultInBothDirections) {
    for (bool reversed : {false, true}) {
        for (bool converter : {false, true}) {
            SCOPED_TRACE(reversed);
            machine.power_on();
            scan_chopped();
            machine.run_us(3'000);
            ASSERT_TRUE(run_until(reversed));
            machine.heard();
            (converter ? machine.converter_works : machine.timer_works) = false;
            machine.longest_on_ns = 0;
            machine.run_us(30'000);
            auto faults = of(MSG_FAULT, machine.heard());
            ASSERT_EQ(faults.size(), 1u);
            EXPECT_EQ(faults[0][AT_FAULT_CODE], converter ? FAULT_CONVERTER : FAULT_CURRENT_TOO_LONG);
            expect_off();
            EXPECT_LT(machine.longest_on_ns, 1e9 / frequency + 3e6);
        }
    }
}

TEST_F(Chopped, RefusesWhatItCannotDo) {
    EXPECT_EQ(set_mode(DRIVE_MODE_CHOPPED, 500, 2), RESULT_WRONG_CONFIGURATION);
    set_up();
    EXPECT_EQ(set_mode(2, 500, 2), RESULT_BAD_VALUE);
    EXPECT_EQ(detail, FIELD_SET_MODE_MODE);
    EXPECT_EQ(set_mode(DRIVE_MODE_CHOPPED, LEAST_CHOP_HZ - 1, 2), RESULT_BAD_VALUE);
    EXPECT_EQ(detail, FIELD_SET_MODE_FREQUENCY);
    EXPECT_EQ(set_mode(DRIVE_MODE_CHOPPED, 5001, 2), RESULT_CHOP_TOO_FAST);
    EXPECT_EQ(detail, 5000u);
    for (unsigned count : {0u, 3u, 4u, 128u}) {
        EXPECT_EQ(set_mode(DRIVE_MODE_CHOPPED, 500, count), RESULT_BAD_VALUE) << count;
        EXPECT_EQ(detail, FIELD_SET_MODE_PERIODS);
    }
    EXPECT_EQ(set_mode(DRIVE_MODE_DIRECT, 500, 0), RESULT_BAD_VALUE);
    EXPECT_EQ(set_mode(DRIVE_MODE_DIRECT, 0, 1), RESULT_BAD_VALUE);
    EXPECT_EQ(set_mode(DRIVE_MODE_DIRECT, 0, 0), RESULT_OK);
    EXPECT_EQ(ask({MSG_SET_MODE, 5, 0, 1, 1}), RESULT_BAD_LENGTH);
}

// docs/protocol.md: half a period takes its own share, dead time, settling in ticks, samples.
TEST_F(Chopped, AFrequencyThatTheScanDoesNotAllowIsRefusedWithTheLimit) {
    set_up();
    double half_ns = 4000 + 1000 * dead + 4000 * (settling / 4 + 1) + 6 * (1000 + 1 * (813 * 64));
    auto limit = static_cast<unsigned>(5e8 / half_ns);
    EXPECT_EQ(set_mode(DRIVE_MODE_CHOPPED, limit + 1, 2), RESULT_OK);
    EXPECT_EQ(start(), RESULT_CHOP_TOO_FAST);
    EXPECT_EQ(detail, limit);
    expect_off();
    EXPECT_EQ(set_mode(DRIVE_MODE_CHOPPED, limit, 2), RESULT_OK);
    EXPECT_EQ(start(), RESULT_OK);
    EXPECT_EQ(set_mode(DRIVE_MODE_DIRECT, 0, 0), RESULT_BUSY);
    machine.run_us(100'000);
    EXPECT_GT(of(MSG_FRAME_CHOPPED, machine.heard()).size(), 2u);
    EXPECT_LE(machine.longest_on_ns, 1e9 / (2 * limit));
}

TEST_F(Chopped, TooManyValuesAreRefused) {
    drives.assign(15, {1, 0, 0xFFFF});
    oversampling = 2;
    periods = 1;
    frequency = 100;
    set_up();
    ASSERT_EQ(set_mode(DRIVE_MODE_CHOPPED, frequency, periods), RESULT_OK);
    EXPECT_EQ(start(), RESULT_TOO_MANY_SAMPLES);
    EXPECT_EQ(detail, MOST_SAMPLES / 2);
}

TEST_F(Chopped, TellsWhatItHoldsAndWhatItIs) {
    EXPECT_EQ(ask({MSG_GET_MODE}), RESULT_WRONG_CONFIGURATION);
    set_up();
    auto tell = [](Bytes payload) {
        machine.heard();
        machine.say(payload);
        machine.run_us(300);
        return machine.heard();
    };
    EXPECT_EQ(tell({MSG_GET_MODE, 77}), std::vector<Bytes>({{MSG_MODE, 77, 5, 0, 0, 0, 0, 0}}));
    ASSERT_EQ(set_mode(DRIVE_MODE_CHOPPED, 500, 2), RESULT_OK);
    EXPECT_EQ(tell({MSG_GET_MODE, 78}), std::vector<Bytes>({{MSG_MODE, 78, 5, 0, 1, 0xF4, 1, 2}}));
    ASSERT_EQ(set_scan(1), RESULT_OK);  // back to what every host understands
    EXPECT_EQ(tell({MSG_GET_MODE, 79}), std::vector<Bytes>({{MSG_MODE, 79, 5, 0, 0, 0, 0, 0}}));
    Bytes board{MSG_BOARD, 80, 'm', 'a', 'c', 'h', 'i', 'n', 'e'};
    board.resize(AT_BOARD_MIN_CHOP);
    for (unsigned value : {10u, 5000u, 4000u, 1000u, 0u, 813u}) {
        board.push_back(low(value));
        board.push_back(high(value));
    }
    EXPECT_EQ(tell({MSG_GET_BOARD, 80}), std::vector<Bytes>({board}));
}

}  // namespace
