#include "scan.h"

#include "config.h"
#include "demodulator.h"
#include "hal.h"
#include "protocol.h"
#include "switches.h"

#include <stddef.h>
#include <string.h>

#define ROOM(size) (FRAMING_BEFORE + (size) + FRAMING_AFTER(size))
#define FRAMES 2u
#define DRIVES 16u /* so that the line may stand still for as long as with frames */
#define FOR_FRAMES (FRAMES * ROOM(MOST_FRAME))
#define FOR_DRIVES (DRIVES * ROOM(MOST_DRIVE_SAMPLES))

/* Longer dead times are waited for by the timer, not in the interrupt, where time for frames and
   the main loop is lost. The line is listened to meanwhile. */
#define LONGEST_BUSY_US 50u
#define SLACK_TICKS (2u * TICKS_PER_MS)

enum phase { IDLE, DEAD, SETTLING, CONVERTING, HOLDING };

static struct {
    enum phase phase;
    uint8_t channel;
    channel_set rest;
    uint8_t drive;
    uint8_t place;   /* of the drive in the order */
    bool singly;     /* each drive is a message of its own */
    uint8_t order;   /* identity of the order under way */
    uint8_t direction;  /* of the drive, from 0: odd ones are reversed */
    uint8_t directions; /* 1: the drive is direct */
    uint16_t on_ticks;  /* for each direction, where there are several */
    uint8_t *at; /* place of the next sample */
    bool packed;
    uint8_t upper; /* bits of the samples whose lower bytes have been put, the newest on top */
    uint8_t group; /* how many those are */
    uint16_t settling_ticks;
    uint32_t since;   /* tick at which the phase's drive began */
    uint32_t allowed; /* ticks that it may take */
    uint32_t sequence;
    uint16_t drops;
    bool dropped; /* something of the turn before */
    bool broken;  /* something of this turn is dropped */
    struct losses told; /* those that a frame's flags have said, or are about to say */
    uint8_t noticed;        /* flags of losses that the next frame says */
} scan;

/* What the host has asked for; the scan takes it up at the end of a drive. */
static struct {
    uint8_t identity;
    uint8_t count; /* 0: all drives of the configuration */
    bool changed;
    uint8_t drives[MOST_ORDER];
} order;

/* Frames, or more of the shorter drives, in the same memory, one behind the other in a ring. The
   format cannot change while one is taken: its command is answered behind it. */
static uint8_t memory[FOR_FRAMES > FOR_DRIVES ? FOR_FRAMES : FOR_DRIVES];
static struct frame slots[DRIVES];
static uint8_t n_slots = FRAMES;
static uint8_t filling;
static volatile uint8_t waiting; /* those before it: whole and not given back */
static bool taken;
static struct scan_fault fault;
static struct {
    uint8_t drive;
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
    *scan.at++ = (uint8_t)sample;
    if (!scan.packed) {
        *scan.at++ = (uint8_t)(sample >> 8);
        return;
    }
    scan.upper = (uint8_t)((uint8_t)(scan.upper >> 2) | (uint8_t)((uint8_t)(sample >> 8) << 6));
    if (++scan.group == 4u) {
        *scan.at++ = scan.upper;
        scan.group = 0u;
    }
}

static void end_samples(void) {
    if (scan.group != 0u) {
        *scan.at++ = (uint8_t)(scan.upper >> (2u * (4u - scan.group)));
        scan.group = 0u;
    }
}

static uint8_t after(uint8_t slot) {
    return slot + 1u == n_slots ? 0u : (uint8_t)(slot + 1u);
}

static uint8_t oldest(void) {
    return (uint8_t)(filling >= waiting ? filling - waiting : filling + n_slots - waiting);
}

static void begin_message(void) {
    struct frame *frame = &slots[filling];
    hal_listen();
    scan.drive = order.count == 0u ? scan.place : order.drives[scan.place];
    frame->started = hal_ticks();
    frame->order = scan.order;
    frame->place = scan.place;
    frame->drive = scan.drive;
    scan.at = frame->buffer + FRAMING_BEFORE + (scan.singly ? SIZE_DRIVE_SAMPLES : SIZE_FRAME);
}

/* What the machine has lost since it was last asked, as flags. */
static void notice_losses(void) {
    struct losses now = hal_losses();
    if (now.conversions != scan.told.conversions) {
        scan.noticed = (uint8_t)(scan.noticed | FLAG_LATE);
    }
    if (now.bytes != scan.told.bytes) {
        scan.noticed = (uint8_t)(scan.noticed | FLAG_DEAF);
    }
    scan.told = now;
}

/* The drives of a turn that are sent one by one all say the same: what the turn before has lost. */
static void begin_turn(void) {
    if (scan.singly) {
        notice_losses();
    }
    scan.order = order.identity;
    order.changed = false;
    scan.place = 0u;
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

static void end_message(void) {
    struct frame *frame = &slots[filling];
    end_samples();
    if (!scan.singly) {
        notice_losses();
    }
    if (waiting == n_slots - 1u) {
        scan.broken = true;
        return;
    }
    frame->sequence = scan.sequence;
    frame->drops = scan.drops;
    frame->size = (uint16_t)(scan.at - (frame->buffer + FRAMING_BEFORE));
    frame->flags = (uint8_t)((scan.sequence == 0u ? FLAG_FIRST : 0u) |
                             (scan.dropped ? FLAG_DROPPED : 0u) | scan.noticed);
    waiting++;
    filling = after(filling);
    hal_wake();
}

static void end_turn(void) {
    scan.dropped = scan.broken;
    if (scan.broken && scan.drops != UINT16_MAX) {
        scan.drops++;
    }
    if (!scan.broken) {
        scan.noticed = 0u;
    }
    scan.broken = false;
    scan.sequence++;
    begin_turn();
}

static void end_drive(void) {
    uint16_t count = order.count == 0u ? config.n_drives : order.count;
    scan.direction = 0u;
    scan.place++;
    bool whole = order.changed || scan.place == count;
    if (!scan.singly && !whole) {
        scan.drive++;
        return;
    }
    end_message();
    if (whole) {
        end_turn();
    }
    begin_message();
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
    if (++scan.direction < scan.directions) {
        begin_drive();
        return;
    }
    hal_listen();
    if (scan.directions > 1u) {
        put_demodulated();
    }
    end_drive();
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

/* What is not being sent is forgotten; what is goes on. */
static void forget(void) {
    filling = taken ? after(oldest()) : 0u;
    waiting = taken;
}

/* Memory for frames, or for drives; nothing of the other kind waits in it. */
static void share(void) {
    forget();
    scan.singly = config_singly();
    n_slots = scan.singly ? DRIVES : FRAMES;
    uint16_t room = scan.singly ? ROOM(MOST_DRIVE_SAMPLES) : ROOM(MOST_FRAME);
    for (uint8_t slot = 0u; slot < n_slots; slot++) {
        slots[slot].buffer = memory + slot * room;
    }
}

void scan_start(void) {
    scan.sequence = 0u;
    scan.drops = 0u;
    scan.dropped = scan.broken = false;
    scan.packed = config_packed();
    scan.group = 0u;
    scan.noticed = 0u;
    scan.settling_ticks = config_ticks(config.settling);
    scan.directions = config_directions();
    scan.on_ticks = on_ticks();
    order.identity = order.count = 0u;
    share();
    demodulator_clear();
    hal_adc_prepare(config.prescaler, config_conversions());
    hal_lock();
    scan.told = hal_losses();
    begin_turn();
    begin_message();
    begin_drive();
    hal_unlock();
}

void scan_order(uint8_t identity, const uint8_t *drives, uint8_t count) {
    if (identity != order.identity) {
        order.identity = identity;
        order.count = count;
        (void)memcpy(order.drives, drives, count);
        order.changed = true;
    }
}

void scan_stop(void) {
    halt();
    fault.code = 0u;
    forget();
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
    if (waiting == 0u || taken) {
        return NULL;
    }
    taken = true;
    return &slots[oldest()];
}

void scan_give_back(void) {
    taken = false;
    waiting--;
}
