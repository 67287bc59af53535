// Drives that are sent one by one, and orders of them, on a watched machine.
#include "fixture.h"

#include <map>
#include <set>

namespace {

class Singly : public Board {
  protected:
    void scan_singly(uint8_t format = FORMAT_DRIVES) {
        set_up();
        ASSERT_EQ(set_format(format), RESULT_OK);
        ASSERT_EQ(start(), RESULT_OK);
    }
    unsigned order(uint8_t identity, Bytes list) {
        Bytes payload{MSG_SET_ORDER, 5, 0, identity};
        payload.insert(payload.end(), list.begin(), list.end());
        return ask(payload);
    }
    static uint64_t ticks(const Bytes &m) {
        return u32_at(m, AT_FRAME_TICKS) | static_cast<uint64_t>(u32_at(m, AT_FRAME_TICKS + 4)) << 32;
    }
    // The frames that full turns make, put together from their parts without the host's code.
    static std::vector<Bytes> assembled(const std::vector<Bytes> &messages) {
        std::map<uint32_t, std::vector<Bytes>> turns;
        for (const Bytes &m : messages) {
            turns[u32_at(m, AT_FRAME_SEQUENCE)].push_back(m);
        }
        std::vector<Bytes> frames;
        for (const auto &[sequence, parts] : turns) {
            if (parts.size() != kElectrodes || parts[0][AT_DRIVE_SAMPLES_ORDER] != 0) {
                continue;
            }
            Bytes frame(parts[0].begin(), parts[0].begin() + SIZE_FRAME);
            frame[0] = MSG_FRAME;
            for (const Bytes &part : parts) {
                frame.insert(frame.end(), part.begin() + SIZE_DRIVE_SAMPLES, part.end());
            }
            frames.push_back(frame);
        }
        return frames;
    }
    void expect_samples(const Bytes &m) {
        const ::Drive &d = drives[m[AT_DRIVE_SAMPLES_DRIVE]];
        size_t at = SIZE_DRIVE_SAMPLES;
        for (int e = 0; e < 16; e++) {
            if (d.mask >> e & 1) {
                ASSERT_EQ(u16_at(m, at), oversampling * code_of(d.source, d.sink, e));
                at += 2;
            }
        }
        EXPECT_EQ(at, m.size());
    }
};

TEST_F(Singly, ALossIsSaidByAllDrivesOfTheTurnAfter) {
    scan_singly();
    machine.run_us(50'000);
    uint32_t last = u32_at(of(MSG_DRIVE_SAMPLES, machine.heard()).back(), AT_FRAME_SEQUENCE);
    machine.lost.conversions++;
    machine.run_us(100'000);
    std::map<uint32_t, std::set<unsigned>> flags;
    for (const Bytes &m : of(MSG_DRIVE_SAMPLES, machine.heard())) {
        flags[u32_at(m, AT_FRAME_SEQUENCE)].insert(m[AT_FRAME_FLAGS]);
    }
    unsigned late = 0;
    for (const auto &[sequence, said] : flags) {
        EXPECT_EQ(said.size(), 1u) << "turn " << sequence;
        if (said.count(FLAG_LATE) != 0) {
            late++;
            EXPECT_LE(sequence, last + 2);
        }
    }
    EXPECT_EQ(late, 1u);
}

TEST_F(Singly, AFullTurnIsTheFrameToTheBit) {
    scan();
    machine.run_us(200'000);
    auto whole = of(MSG_FRAME, machine.heard());
    uint64_t began = ticks(whole[0]);
    machine.power_on();
    scan_singly();
    machine.run_us(200'000);
    auto all = machine.heard();
    EXPECT_TRUE(of(MSG_FRAME, all).empty());
    auto frames = assembled(of(MSG_DRIVE_SAMPLES, all));
    ASSERT_GT(frames.size(), 10u);
    uint64_t later = ticks(frames[0]) - began;  // one command more came before START
    for (size_t k = 0; k < frames.size(); k++) {
        Bytes expected = whole[k];
        for (size_t b = 0; b < 8; b++) {
            expected[AT_FRAME_TICKS + b] = static_cast<uint8_t>((ticks(whole[k]) + later) >> 8 * b);
        }
        ASSERT_EQ(frames[k], expected) << k;
    }
}

TEST_F(Singly, ADriveIsSentWhenItHasBeenRead) {
    settling = 20'000;
    scan_singly();
    machine.run_us(22'000);
    auto first = of(MSG_DRIVE_SAMPLES, machine.heard());
    ASSERT_EQ(first.size(), 1u);
    expect_samples(first[0]);
    machine.run_us(90'000);
    auto more = of(MSG_DRIVE_SAMPLES, machine.heard());
    ASSERT_GE(more.size(), 3u);
    EXPECT_NEAR(double(ticks(more[0]) - ticks(first[0])) * 4.0, 20'000 + 6 * 4 * 52 + 5, 40);
}

TEST_F(Singly, PackedDrivesHoldTenBits) {
    oversampling = 1;
    scan_singly(FORMAT_DRIVES_PACKED);
    machine.run_us(20'000);
    auto messages = of(MSG_DRIVE_SAMPLES_PACKED, machine.heard());
    ASSERT_GT(messages.size(), 8u);
    for (const Bytes &m : messages) {
        Bytes packed(m.begin() + SIZE_DRIVE_SAMPLES_PACKED, m.end());
        ASSERT_EQ(packed.size(), 8u);  // six samples: four and their upper bits, two and theirs
        const ::Drive &d = drives[m[AT_DRIVE_SAMPLES_DRIVE]];
        size_t s = 0;
        for (int e = 0; e < 8; e++) {
            if (d.mask >> e & 1) {
                size_t group = s / 4 * 5;
                size_t upper = std::min(group + 4, packed.size() - 1);
                ASSERT_EQ(packed[group + s % 4] | (packed[upper] >> 2 * (s % 4) & 3u) << 8,
                          code_of(d.source, d.sink, e));
                s++;
            }
        }
    }
}

TEST_F(Singly, AlternatingDrivesToo) {
    set_up();
    ASSERT_EQ(ask({MSG_SET_MODE, 5, 0, DRIVE_MODE_CHOPPED, 0xF4, 1, 2}), RESULT_OK);
    ASSERT_EQ(set_format(FORMAT_DRIVES), RESULT_OK);
    ASSERT_EQ(start(), RESULT_OK);
    machine.run_us(100'000);
    auto messages = of(MSG_DRIVE_SAMPLES_CHOPPED, machine.heard());
    ASSERT_GT(messages.size(), 8u);
    for (const Bytes &m : messages) {
        const ::Drive &d = drives[m[AT_DRIVE_SAMPLES_DRIVE]];
        ASSERT_EQ(m.size(), SIZE_DRIVE_SAMPLES_CHOPPED + 24u);
        int first = d.mask & 1 ? 0 : d.mask & 2 ? 1 : 2;
        int ahead = 2 * code_of(d.source, d.sink, first), back = 2 * code_of(d.sink, d.source, first);
        EXPECT_EQ(u16_at(m, SIZE_DRIVE_SAMPLES_CHOPPED), static_cast<unsigned>(ahead - back + 32768));
        EXPECT_EQ(u16_at(m, SIZE_DRIVE_SAMPLES_CHOPPED + 2), static_cast<unsigned>(ahead + back));
    }
}

TEST_F(Singly, AnOrderIsScannedFromTheNextDriveOnUntilAnotherComes) {
    scan_singly();
    machine.run_us(20'000);
    machine.heard();
    meanwhile.clear();
    auto pass = [this](uint64_t us) {
        machine.run_us(us);
        auto all = machine.heard();
        meanwhile.insert(meanwhile.end(), all.begin(), all.end());
    };
    EXPECT_EQ(order(7, {2, 5, 2}), RESULT_OK);
    pass(30'000);
    EXPECT_EQ(order(7, {2, 5, 2}), RESULT_OK);  // the same once more changes nothing
    EXPECT_EQ(order(9, {4}), RESULT_OK);
    pass(20'000);
    EXPECT_EQ(order(0, {}), RESULT_OK);
    pass(40'000);
    const Bytes list{2, 5, 2};
    unsigned stage = 0, place = 0;
    uint32_t sequence = 0;
    uint64_t before = 0;
    auto messages = of(MSG_DRIVE_SAMPLES, meanwhile);
    for (const Bytes &m : messages) {
        unsigned identity = m[AT_DRIVE_SAMPLES_ORDER];
        const unsigned stages[] = {0, 7, 9, 0};
        if (identity != stages[stage]) {
            stage++;
            ASSERT_LT(stage, 4u);
            ASSERT_EQ(identity, stages[stage]);
            EXPECT_EQ(m[AT_DRIVE_SAMPLES_PLACE], 0u) << "an order begins at its first drive";
        }
        unsigned at = m[AT_DRIVE_SAMPLES_PLACE];
        if (before != 0) {
            EXPECT_GT(ticks(m), before);
            if (at == 0) {
                EXPECT_EQ(u32_at(m, AT_FRAME_SEQUENCE), sequence + 1);
            } else {
                EXPECT_EQ(at, place + 1);
                EXPECT_EQ(u32_at(m, AT_FRAME_SEQUENCE), sequence);
            }
        }
        unsigned drive = identity == 7 ? list[at] : identity == 9 ? 4u : at;
        EXPECT_EQ(m[AT_DRIVE_SAMPLES_DRIVE], drive);
        expect_samples(m);
        before = ticks(m), place = at, sequence = u32_at(m, AT_FRAME_SEQUENCE);
    }
    EXPECT_EQ(stage, 3u);
    EXPECT_GE(assembled(messages).size(), 1u);
}

TEST_F(Singly, OrdersThatCannotBeAreRefused) {
    EXPECT_EQ(order(1, {0}), RESULT_NOT_SINGLY);
    scan();
    EXPECT_EQ(order(1, {0}), RESULT_NOT_SINGLY);
    EXPECT_EQ(ask({MSG_STOP}), RESULT_OK);
    scan_singly();
    EXPECT_EQ(order(1, {8}), RESULT_BAD_VALUE);
    EXPECT_EQ(detail, FIELD_SET_ORDER_DRIVES);
    EXPECT_EQ(order(1, {}), RESULT_BAD_VALUE);
    EXPECT_EQ(order(0, {1}), RESULT_BAD_VALUE);
    EXPECT_EQ(ask({MSG_SET_ORDER, 6, 0, 1, 0}), RESULT_WRONG_CONFIGURATION);
    EXPECT_EQ(ask({MSG_SET_ORDER, 5, 0}), RESULT_BAD_LENGTH);
    EXPECT_EQ(order(1, Bytes(55, 7)), RESULT_OK);
}

TEST_F(Singly, StartAndStopForgetTheOrder) {
    scan_singly();
    EXPECT_EQ(order(3, {6}), RESULT_OK);
    machine.run_us(7'777);
    EXPECT_EQ(ask({MSG_STOP}), RESULT_OK);
    expect_off();
    machine.heard();
    EXPECT_EQ(start(), RESULT_OK);
    machine.run_us(50'000);
    auto frames = assembled(of(MSG_DRIVE_SAMPLES, machine.heard()));
    ASSERT_GT(frames.size(), 2u);
    expect_frames(frames);
}

TEST_F(Singly, AfterDrivesAFrameIsWholeAgain) {
    scan_singly();
    machine.room = 1;
    machine.run_us(9'000, 500);
    machine.heard();
    machine.room = 2000;
    EXPECT_EQ(ask({MSG_STOP}), RESULT_OK);
    EXPECT_EQ(set_format(FORMAT_SIXTEEN), RESULT_OK);
    EXPECT_EQ(start(), RESULT_OK);
    machine.run_us(50'000);
    auto frames = of(MSG_FRAME, machine.heard());
    ASSERT_GT(frames.size(), 2u);
    expect_frames(frames);
}

TEST_F(Singly, FramesBehindAnyNumberOfDrivesStayInTheirMemory) {
    drives.assign(26, {15, 14, 0xFFFF});  // long frames
    oversampling = 1;
    for (unsigned ms = 5; ms < 45; ms++) {
        SCOPED_TRACE(ms);
        machine.power_on();
        scan_singly();
        machine.run_us(ms * 1000);
        EXPECT_EQ(ask({MSG_STOP}), RESULT_OK);
        EXPECT_EQ(set_format(FORMAT_SIXTEEN), RESULT_OK);
        machine.heard();
        EXPECT_EQ(start(), RESULT_OK);
        machine.run_us(120'000);
        auto frames = of(MSG_FRAME, machine.heard());
        ASSERT_GT(frames.size(), 2u);
        expect_frames(frames);
    }
}

TEST_F(Singly, ASlowLineBreaksTurnsAndCountsThem) {
    scan_singly();
    for (int k = 0; k < 10; k++) {
        machine.room = 0;
        machine.run_us(100'000);
        machine.room = 2000;
        machine.run_us(30'000);
    }
    std::map<uint32_t, std::vector<Bytes>> turns;
    for (const Bytes &m : of(MSG_DRIVE_SAMPLES, machine.heard())) {
        turns[u32_at(m, AT_FRAME_SEQUENCE)].push_back(m);
        expect_samples(m);
    }
    unsigned drops = 0;
    bool before = true;
    for (uint32_t sequence = 0; sequence < turns.rbegin()->first; sequence++) {
        auto &parts = turns[sequence];
        for (const Bytes &m : parts) {
            EXPECT_EQ(u16_at(m, AT_FRAME_DROPS), drops);
            EXPECT_EQ((m[AT_FRAME_FLAGS] & FLAG_DROPPED) != 0, !before);
        }
        before = parts.size() == kElectrodes;
        drops += before ? 0 : 1;
    }
    EXPECT_GT(drops, 10u);
}

TEST_F(Singly, HostSilenceAndAConverterThatHangsSwitchOff) {
    scan_singly();
    EXPECT_EQ(order(3, {6}), RESULT_OK);
    machine.converter_works = false;
    machine.run_us(30'000);
    auto faults = of(MSG_FAULT, machine.heard());
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0][AT_FAULT_CODE], FAULT_CONVERTER);
    expect_off();
    machine.power_on();
    scan_singly();
    EXPECT_EQ(order(3, {6}), RESULT_OK);
    machine.run_us(2'010'000, 1000);
    EXPECT_EQ(of(MSG_FAULT, machine.heard()).size(), 1u);
    expect_off();
}

}  // namespace
