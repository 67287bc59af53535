#include "scan.h"

#include "config.h"
#include "demodulator.h"
#include "hal.h"
#include "protocol.h"
#include "switches.h"

#include <stddef.h>

/* Longer dead times are waited for by the timer, not in the interrupt, where time for frames and
   the main loop is lost. The line is listened to meanwhile. */
#define LONGEST_BUSY_US 50u
#define SLACK_TICKS (2u * TICKS_PER_MS)

enum phase { IDLE, DEAD, SETTLING, CONVERTING, HOLDING };

static struct {
    enum phase phase;
    uint8_t channel;
    channel_set rest;
    uint16_t drive;
    uint8_t direction;  /* of the drive, from 0: odd ones are reversed */
    uint8_t directions; /* 1: the drive is direct */
    uint16_t on_ticks;  /* for each direction, where there are several */
    uint8_t *place; /* of the next sample */
    bool packed;
    uint8_t upper; /* bits of the samples whose lower bytes have been put, the newest on top */
    uint8_t group; /* how many those are */
    uint16_t settling_ticks;
    uint32_t since;   /* tick at which the phase's drive began */
    uint32_t allowed; /* ticks that it may take */
    uint32_t sequence;
    uint16_t drops;
    bool dropped;
} scan;

static struct frame frames[2];
static uint8_t filling;
static volatile bool waiting; /* the other frame is whole and not given back */
static bool taken;
static struct scan_fault fault;
static struct {
    uint16_t drive;
    uint8_t channel;
    uint32_t sequence;
} seen; /* where the guard found the scan last */

static void halt(void) {
    switches_off();
    scan.phase = IDLE;
    hal_timer_cancel();
    hal_adc_cancel();
}

static void fail(uint8_t code, uint16_t detail) {
    halt();
    fault.code = code;
    fault.detail = detail;
    hal_wake();
}

static bool reversed(void) {
    return (scan.direction & 1u) != 0u;
}

static uint32_t allowed_ticks(const struct drive *drive) {
    uint8_t channels = 0u;
    if (scan.directions > 1u) {
        return scan.on_ticks + SLACK_TICKS;
    }
    for (channel_set rest = drive->mask; rest != 0u; rest &= (channel_set)(rest - 1u)) {
        channels++;
    }
    uint32_t converting = (uint32_t)channels * hal_adc_ticks();
    return scan.settling_ticks + 2u * converting + SLACK_TICKS;
}

/* A sample as FRAME holds it, or as FRAME_PACKED: its lower byte, and after four the upper bits. */
static void put_sample(uint16_t sample) {
    *scan.place++ = (uint8_t)sample;
    if (!scan.packed) {
        *scan.place++ = (uint8_t)(sample >> 8);
        return;
    }
    scan.upper = (uint8_t)((uint8_t)(scan.upper >> 2) | (uint8_t)((uint8_t)(sample >> 8) << 6));
    if (++scan.group == 4u) {
        *scan.place++ = scan.upper;
        scan.group = 0u;
    }
}

static void end_samples(void) {
    if (scan.group != 0u) {
        *scan.place++ = (uint8_t)(scan.upper >> (2u * (4u - scan.group)));
        scan.group = 0u;
    }
}

static void begin_frame(void) {
    struct frame *frame = &frames[filling];
    hal_listen();
    frame->started = hal_ticks();
    scan.place = frame->buffer + FRAMING_BEFORE + SIZE_FRAME;
    scan.drive = 0u;
    scan.direction = 0u;
}

static void connect(uint16_t dead_time) {
    const struct drive *drive = &config.drives[scan.drive];
    uint8_t source = reversed() ? drive->sink : drive->source;
    uint8_t sink = reversed() ? drive->source : drive->sink;
    scan.rest = drive->mask;
    scan.channel = 0u;
    hal_listen();
    scan.allowed = allowed_ticks(drive);
    hal_listen();
    if (!switches_set(source, sink, dead_time)) {
        fail(FAULT_SWITCH_REFUSED, scan.drive);
        return;
    }
    scan.since = hal_ticks();
    scan.phase = SETTLING;
    hal_timer_set(scan.settling_ticks);
}

static void begin_drive(void) {
    if (config.dead_time <= LONGEST_BUSY_US) {
        connect(config.dead_time);
        return;
    }
    uint16_t ticks = config_ticks(config.dead_time);
    scan.phase = DEAD;
    scan.since = hal_ticks();
    scan.allowed = ticks + SLACK_TICKS;
    hal_timer_set(ticks);
}

static void end_frame(void) {
    struct frame *frame = &frames[filling];
    end_samples();
    if (waiting) {
        scan.dropped = true;
        scan.drops = scan.drops == UINT16_MAX ? UINT16_MAX : (uint16_t)(scan.drops + 1u);
    } else {
        frame->sequence = scan.sequence;
        frame->drops = scan.drops;
        frame->size = (uint16_t)(scan.place - (frame->buffer + FRAMING_BEFORE));
        frame->flags = (uint8_t)((scan.sequence == 0u ? FLAG_FIRST : 0u) |
                                 (scan.dropped ? FLAG_DROPPED : 0u));
        scan.dropped = false;
        waiting = true;
        filling ^= 1u;
        hal_wake();
    }
    scan.sequence++;
    begin_frame();
}

static void put_demodulated(void) {
    uint8_t channel = 0u;
    for (channel_set rest = config.drives[scan.drive].mask; rest != 0u; rest >>= 1, channel++) {
        if ((rest & 1u) != 0u) {
            put_sample(demodulator_difference(channel));
            hal_listen();
            put_sample(demodulator_sum(channel));
            hal_listen();
        }
    }
    demodulator_clear();
    hal_listen();
}

/* The next direction of the drive, or the next drive. */
static void end_direction(void) {
    switches_off();
    hal_listen();
    if (++scan.direction < scan.directions) {
        begin_drive();
        return;
    }
    if (scan.directions > 1u) {
        put_demodulated();
    }
    scan.direction = 0u;
    scan.drive++;
    if (scan.drive == config.n_drives) {
        end_frame();
    }
    begin_drive();
}

/* Start converting the next channel of the drive; false when there is none. */
static bool next_channel(void) {
    if (scan.rest == 0u) {
        return false;
    }
    while ((scan.rest & 1u) == 0u) {
        scan.rest >>= 1;
        scan.channel++;
    }
    hal_adc_start(scan.channel);
    return true;
}

/* All channels have been read: where the drive has several directions, each is on for as long. */
static void end_reading(void) {
    if (scan.directions == 1u) {
        end_direction();
        return;
    }
    scan.phase = HOLDING;
    hal_timer_extend(scan.on_ticks);
}

void scan_on_timer(void) {
    if (scan.phase == DEAD) {
        connect(0u);
    } else if (scan.phase == SETTLING) {
        scan.phase = CONVERTING;
        if (!next_channel()) {
            end_reading();
        }
    } else if (scan.phase == HOLDING) {
        end_direction();
    }
}

void scan_on_sample(uint16_t sum) {
    if (scan.phase != CONVERTING) {
        return;
    }
    uint8_t channel = scan.channel;
    scan.rest >>= 1;
    scan.channel++;
    bool more = next_channel(); /* it runs while this one is booked */
    hal_listen();
    if (scan.directions == 1u) {
        put_sample(sum);
    } else {
        demodulator_add(channel, reversed(), sum);
    }
    if (!more) {
        end_reading();
    }
}

/* Half a period ends with the dead time. */
static uint16_t on_ticks(void) {
    return config.frequency == 0u
               ? 0u
               : (uint16_t)((UINT32_C(500000) / config.frequency - config.dead_time) / US_PER_TICK);
}

void scan_start(void) {
    scan.sequence = 0u;
    scan.drops = 0u;
    scan.dropped = false;
    scan.packed = config.format == FORMAT_PACKED;
    scan.group = 0u;
    scan.settling_ticks = config_ticks(config.settling);
    scan.directions = config_directions();
    scan.on_ticks = on_ticks();
    hal_listen();
    demodulator_clear();
    hal_adc_prepare(config.prescaler, config_conversions());
    begin_frame();
    begin_drive();
}

void scan_stop(void) {
    halt();
    fault.code = 0u;
    waiting = taken; /* a frame that is being sent goes on */
}

bool scan_running(void) {
    return scan.phase != IDLE;
}

static bool stands_still(void) {
    bool same = seen.drive == scan.drive && seen.channel == scan.channel &&
                seen.sequence == scan.sequence;
    seen.drive = scan.drive;
    seen.channel = scan.channel;
    seen.sequence = scan.sequence;
    return same;
}

void scan_guard(uint32_t now) {
    if (scan.phase == IDLE) {
        return;
    }
    bool still = stands_still();
    if (now - scan.since <= scan.allowed) {
        return;
    }
    if (scan.phase == DEAD) {
        fail(FAULT_INTERNAL, scan.drive);
    } else if (scan.phase == CONVERTING && still) {
        fail(FAULT_CONVERTER, scan.channel);
    } else {
        fail(FAULT_CURRENT_TOO_LONG, scan.drive);
    }
}

struct scan_fault scan_take_fault(void) {
    struct scan_fault found = fault;
    fault.code = 0u;
    return found;
}

struct frame *scan_take(void) {
    if (!waiting || taken) {
        return NULL;
    }
    taken = true;
    return &frames[filling ^ 1u];
}

void scan_give_back(void) {
    taken = waiting = false;
}
