#include "machine.h"

#include <algorithm>

extern "C" {
#include "scan.h"
}

Machine machine;

uint16_t code_of(int source, int sink, int channel) {
    return static_cast<uint16_t>((source * 61 + sink * 17 + channel * 5 + 3) % 1024);
}

uint16_t slow_crc(const Bytes &data) {
    unsigned crc = 0xFFFF;
    for (uint8_t byte : data) {
        for (int bit = 7; bit >= 0; bit--) {
            unsigned top = (crc >> 15) ^ (byte >> bit & 1u);
            crc = (crc << 1 & 0xFFFF) ^ (top ? 0x1021u : 0u);
        }
    }
    return static_cast<uint16_t>(crc);
}

Bytes enclose(Bytes data) {
    uint16_t crc = slow_crc(data);
    data.push_back(static_cast<uint8_t>(crc >> 8));
    data.push_back(static_cast<uint8_t>(crc & 0xFF));
    Bytes out{0};
    size_t code = 0;
    for (size_t at = 0; at < data.size(); at++) {
        if (data[at] != 0) {
            out.push_back(data[at]);
        }
        bool full = out.size() - code == 255;
        if (data[at] == 0 || (full && at + 1 < data.size())) {
            out[code] = static_cast<uint8_t>(out.size() - code);
            code = out.size();
            out.push_back(0);
        }
    }
    out[code] = static_cast<uint8_t>(out.size() - code);
    out.push_back(0);
    return out;
}

static Bytes open(const Bytes &block) {
    Bytes data;
    for (size_t at = 0; at < block.size();) {
        size_t code = block[at];
        if (at + code > block.size()) {
            return {};
        }
        data.insert(data.end(), block.begin() + static_cast<long>(at) + 1,
                    block.begin() + static_cast<long>(at + code));
        at += code;
        if (code < 255 && at < block.size()) {
            data.push_back(0);
        }
    }
    if (data.size() < 3 || slow_crc(data) != 0) {
        return {};
    }
    data.resize(data.size() - 2);
    return data;
}

void Machine::power_on() {
    Machine fresh;
    fresh.current = current;
    fresh.reset_cause = reset_cause;
    *this = fresh;
    board_start();
}

bool Machine::deliver(uint64_t until) {
    uint64_t due = std::min(timer_ns, adc_ns);
    if (due > until) {
        return false;
    }
    ns = std::max(ns, due);
    if (due == timer_ns) {
        timer_ns = UINT64_MAX;
        scan_on_timer();
    } else {
        adc_ns = UINT64_MAX;
        scan_on_sample(static_cast<uint16_t>(conversions * code_of(source, sink, converted)));
    }
    return true;
}

void Machine::run_us(uint64_t us, uint64_t round_us) {
    uint64_t end = ns + us * 1000;
    while (ns < end) {
        uint64_t next = std::min(end, ns + round_us * 1000);
        if (!deliver(next)) {
            ns = next;
        }
        board_step();
    }
}

void Machine::hang_us(uint64_t us) {
    uint64_t end = ns + us * 1000;
    while (deliver(end)) {
    }
    ns = end;
}

void Machine::say(const Bytes &payload) {
    say_raw(enclose(payload));
}

void Machine::say_raw(const Bytes &bytes) {
    line.insert(line.end(), bytes.begin(), bytes.end());
}

std::vector<Bytes> Machine::heard() {
    std::vector<Bytes> payloads;
    Bytes block;
    for (uint8_t byte : sent) {
        if (byte != 0) {
            block.push_back(byte);
            continue;
        }
        Bytes payload = open(block);
        if (payload.empty()) {
            wrongs.push_back("a block on the line is torn");
        }
        payloads.push_back(payload);
        block.clear();
    }
    sent = block;
    return payloads;
}

void Machine::note(Move move, int a, int b) {
    events.push_back({move, ns, a, b});
}

extern "C" {

static const struct hal_board this_board = {"machine", 5000, 4000, 1000, 0, 813};
const struct hal_board *hal_board = &this_board;
void hal_init(void) {}
uint8_t hal_reset_cause(void) { return machine.reset_cause; }
void hal_unique_id(uint8_t *id) { std::fill(id, id + 8, uint8_t{7}); }
void hal_listen(void) {}
uint32_t hal_current(void) { return machine.current; }
bool hal_against_neighbour(void) { return machine.against_neighbour; }

void hal_switches_disable(void) {
    machine.note(Machine::Move::kDisable);
    if (machine.source >= 0) {
        machine.longest_on_ns = std::max(machine.longest_on_ns, machine.ns - machine.enabled_ns);
        machine.disabled_ns = machine.ns;
    }
    machine.source = machine.sink = -1;
    machine.latched_source = machine.latched_sink = -1;
}

void hal_switches_address(uint8_t source, uint8_t sink) {
    machine.note(Machine::Move::kAddress, source, sink);
    if (machine.source >= 0) {
        machine.wrongs.push_back("addressed while connected");
    }
    machine.address_source = source;
    machine.address_sink = sink;
}

void hal_switches_latch(void) {
    machine.note(Machine::Move::kLatch);
    machine.latched_source = machine.address_source;
    machine.latched_sink = machine.address_sink;
}

void hal_switches_enable(uint8_t source, uint8_t sink) {
    machine.note(Machine::Move::kEnable, source, sink);
    if (machine.source >= 0) {
        machine.wrongs.push_back("make before break");
    }
    if (source == sink) {
        machine.wrongs.push_back("source = sink");
    }
    if (source >= CHANNELS || sink >= CHANNELS) {
        machine.wrongs.push_back("no such channel");
    }
    if (machine.latched_source != source || machine.latched_sink != sink) {
        machine.wrongs.push_back("enabled what was not addressed and latched");
    }
    uint64_t least = std::max<uint64_t>(machine.dead_ns, LEAST_DEAD_TIME_US * 1000u);
    if (machine.disabled_ns != 0 && machine.ns - machine.disabled_ns < least) {
        machine.wrongs.push_back("dead time too short");
    }
    machine.source = source;
    machine.sink = sink;
    machine.enabled_ns = machine.ns;
}

uint32_t hal_ticks(void) { return static_cast<uint32_t>(machine.ns / (US_PER_TICK * 1000u)); }
void hal_delay_us(uint16_t us) { machine.ns += us * uint64_t{1000}; }

void hal_timer_set(uint16_t ticks) {
    if (machine.timer_works) {
        machine.timer_set_ns = machine.ns;
        machine.timer_ns = (machine.ns / 4000 + ticks) * 4000;
    }
}
void hal_timer_extend(uint16_t ticks) {
    if (machine.timer_works) {
        machine.timer_ns = std::max(machine.ns, (machine.timer_set_ns / 4000 + ticks) * 4000);
    }
}
void hal_timer_cancel(void) { machine.timer_ns = UINT64_MAX; }
void hal_adc_prepare(uint8_t prescaler, uint8_t conversions) {
    machine.conversions = conversions;
    machine.sample_ns = conversions * (prescaler * 13000u / 16u);
}
uint16_t hal_adc_ticks(void) { return static_cast<uint16_t>(machine.sample_ns / 4000u + 1u); }
void hal_adc_start(uint8_t channel) {
    machine.converted = channel;
    if (machine.converter_works) {
        machine.adc_ns = machine.ns + machine.sample_ns;
    }
}
void hal_adc_cancel(void) { machine.adc_ns = UINT64_MAX; }
struct losses hal_losses(void) { return machine.lost; }

int16_t hal_uart_get(void) {
    if (machine.line.empty()) {
        return -1;
    }
    int16_t byte = machine.line.front();
    machine.line.pop_front();
    return byte;
}
void hal_uart_send(const uint8_t *bytes, uint16_t size) {
    if (!machine.sending.empty()) {
        machine.wrongs.push_back("a message sent over another");
    }
    machine.sending = {bytes, size};
    (void)hal_uart_busy();
}
bool hal_uart_busy(void) {
    size_t taken = std::min<size_t>(machine.room, machine.sending.size());
    machine.sent.insert(machine.sent.end(), machine.sending.begin(),
                        machine.sending.begin() + taken);
    machine.sending.remove_prefix(taken);
    return !machine.sending.empty();
}
bool hal_uart_sent(void) { return machine.sending.empty(); }
uint16_t hal_crc16(uint16_t crc, uint8_t byte) { return crc16_step(crc, byte); }
bool hal_uart_up(void) { return machine.plugged_in; }
bool hal_uart_can(uint32_t baud) { return baud == 500000 || baud == FIRST_BAUD; }
void hal_uart_set_baud(uint32_t baud) { machine.baud = baud; }

void hal_lock(void) {
    if (machine.locked) {
        machine.wrongs.push_back("locks nest");
    }
    machine.locked = true;
}
void hal_unlock(void) { machine.locked = false; }
void hal_wake(void) {}
void hal_idle(void) {}
void hal_watchdog_kick(void) { machine.kicked_ns = machine.ns; }
}
