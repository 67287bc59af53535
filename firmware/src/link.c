#include "link.h"

#include "bytes.h"
#include "config.h"
#include "framing.h"
#include "hal.h"
#include "limits.h"
#include "protocol.h"
#include "scan.h"

#include <assert.h>
#include <stddef.h>

static_assert(SIZE_FRAME == SIZE_FRAME_PACKED && SIZE_FRAME == SIZE_FRAME_CHOPPED, "one head for all");
static_assert(SIZE_DRIVE_SAMPLES == SIZE_DRIVE_SAMPLES_PACKED && SIZE_DRIVE_SAMPLES == SIZE_DRIVE_SAMPLES_CHOPPED,
              "one head for all");
static_assert(AT_DRIVE_SAMPLES_ORDER == SIZE_FRAME, "a drive's head begins as a frame's");

#define MOST_TOLD 9u /* drives in a PATTERN */

#define MOST_SMALL (SIZE_PATTERN + MOST_TOLD * SIZE_DRIVE)

static uint8_t buffer[FRAMING_BEFORE + MOST_SMALL + FRAMING_AFTER(MOST_SMALL)];
static uint8_t *const small = buffer + FRAMING_BEFORE;
static uint8_t small_size; /* of the payload; 0: free */
static enum { NOTHING, SMALL, FRAME } under_way;

void link_reset(void) {
    small_size = 0u;
    under_way = NOTHING;
}

/* The message under way, once it is sent: its buffer is free again. */
static void note_sent(void) {
    if (hal_uart_busy()) {
        return;
    }
    if (under_way == FRAME) {
        hal_lock();
        scan_give_back();
        hal_unlock();
    } else if (under_way == SMALL) {
        small_size = 0u;
    }
    under_way = NOTHING;
}

bool link_free(void) {
    note_sent();
    return small_size == 0u;
}

void link_say_hello(void) {
    small[0] = MSG_HELLO;
    small[AT_HELLO_MAJOR] = PROTOCOL_MAJOR;
    small[AT_HELLO_MINOR] = PROTOCOL_MINOR;
    put_u32(small + AT_HELLO_SCHEMA_HASH, PROTOCOL_HASH);
    small_size = SIZE_HELLO;
}

void link_say_info(uint8_t request, uint8_t reset_cause) {
    small[0] = MSG_INFO;
    small[AT_INFO_REQUEST] = request;
    small[AT_INFO_MAJOR] = PROTOCOL_MAJOR;
    small[AT_INFO_MINOR] = PROTOCOL_MINOR;
    put_u32(small + AT_INFO_SCHEMA_HASH, PROTOCOL_HASH);
    small[AT_INFO_FIRMWARE] = FIRMWARE_MAJOR;
    small[AT_INFO_FIRMWARE + 1u] = FIRMWARE_MINOR;
    small[AT_INFO_FIRMWARE + 2u] = FIRMWARE_PATCH;
    small[AT_INFO_RESET] = reset_cause;
    small[AT_INFO_CHANNELS] = CHANNELS;
    small[AT_INFO_ADC_BITS] = ADC_BITS;
    small[AT_INFO_MAX_OVERSAMPLING] = MOST_OVERSAMPLING;
    put_u16(small + AT_INFO_MAX_DRIVES, MOST_DRIVES);
    put_u16(small + AT_INFO_MAX_SAMPLES, MOST_SAMPLES);
    put_u32(small + AT_INFO_TICK_RATE, TICKS_PER_SECOND);
    put_u32(small + AT_INFO_CURRENT, hal_current());
    put_u32(small + AT_INFO_MAX_BAUD, FIRST_BAUD);
    hal_unique_id(small + AT_INFO_UNIQUE_ID);
    small_size = SIZE_INFO;
}

void link_say_ack(uint8_t request, uint8_t command, uint8_t result, uint16_t detail) {
    small[0] = MSG_ACK;
    small[AT_ACK_REQUEST] = request;
    small[AT_ACK_COMMAND] = command;
    small[AT_ACK_RESULT] = result;
    put_u16(small + AT_ACK_DETAIL, detail);
    small_size = SIZE_ACK;
}

void link_say_scan(uint8_t request) {
    small[0] = MSG_SCAN;
    small[AT_SCAN_REQUEST] = request;
    put_u16(small + AT_SCAN_CONFIGURATION, config.identity);
    put_u16(small + AT_SCAN_N_DRIVES, config.n_drives);
    put_u32(small + AT_SCAN_SETTLING, config.settling);
    put_u16(small + AT_SCAN_DEAD_TIME, config.dead_time);
    small[AT_SCAN_OVERSAMPLING] = config.oversampling;
    small[AT_SCAN_PRESCALER] = config.prescaler;
    put_u32(small + AT_SCAN_CURRENT_LIMIT, config.current_limit);
    small[AT_SCAN_FORMAT] = config.format;
    small_size = SIZE_SCAN;
}

void link_say_mode(uint8_t request) {
    small[0] = MSG_MODE;
    small[AT_MODE_REQUEST] = request;
    put_u16(small + AT_MODE_CONFIGURATION, config.identity);
    small[AT_MODE_MODE] = config.mode;
    put_u16(small + AT_MODE_FREQUENCY, config.frequency);
    small[AT_MODE_PERIODS] = config.periods;
    small_size = SIZE_MODE;
}

void link_say_losses(uint8_t request) {
    hal_lock();
    struct losses losses = hal_losses();
    hal_unlock();
    small[0] = MSG_LOSSES;
    small[AT_LOSSES_REQUEST] = request;
    put_u16(small + AT_LOSSES_CONVERSIONS, losses.conversions);
    put_u16(small + AT_LOSSES_BYTES, losses.bytes);
    small_size = SIZE_LOSSES;
}

void link_say_board(uint8_t request) {
    small[0] = MSG_BOARD;
    small[AT_BOARD_REQUEST] = request;
    const char *letter = hal_board->name;
    for (uint8_t at = AT_BOARD_NAME; at < AT_BOARD_MIN_CHOP; at++) {
        small[at] = (uint8_t)*letter;
        letter += *letter != '\0';
    }
    put_u16(small + AT_BOARD_MIN_CHOP, LEAST_CHOP_HZ);
    put_u16(small + AT_BOARD_MAX_CHOP, hal_board->most_chop_hz);
    put_u16(small + AT_BOARD_HALF, hal_board->half_ns);
    put_u16(small + AT_BOARD_SAMPLE, hal_board->sample_ns);
    put_u16(small + AT_BOARD_CONVERSION, hal_board->conversion_ns);
    put_u16(small + AT_BOARD_CLOCK, hal_board->clock_ns);
    small_size = SIZE_BOARD;
}

void link_say_pattern(uint8_t request, uint16_t first) {
    uint16_t rest = (uint16_t)(config.n_drives - first);
    small[0] = MSG_PATTERN;
    small[AT_PATTERN_REQUEST] = request;
    put_u16(small + AT_PATTERN_CONFIGURATION, config.identity);
    put_u16(small + AT_PATTERN_FIRST, first);
    small_size = SIZE_PATTERN;
    for (uint8_t told = 0u; told < MOST_TOLD && told < rest; told++) {
        const struct drive *drive = &config.drives[first + told];
        small[small_size + AT_DRIVE_SOURCE] = drive->source;
        small[small_size + AT_DRIVE_SINK] = drive->sink;
        put_u32(small + small_size + AT_DRIVE_MASK, drive->mask);
        small_size = (uint8_t)(small_size + SIZE_DRIVE);
    }
}

void link_say_fault(uint32_t ticks_high, uint32_t ticks, uint8_t code, uint16_t detail) {
    small[0] = MSG_FAULT;
    put_u32(small + AT_FAULT_TICKS, ticks);
    put_u32(small + AT_FAULT_TICKS + 4u, ticks_high);
    small[AT_FAULT_CODE] = code;
    put_u16(small + AT_FAULT_DETAIL, detail);
    small_size = SIZE_FAULT;
}

/* Upper half of a tick whose lower half is given, less than half a turn from now. */
static uint32_t high_of(uint32_t ticks, uint32_t now_high, uint32_t now) {
    if (now - ticks < UINT32_C(0x80000000)) {
        return ticks > now ? now_high - 1u : now_high;
    }
    return ticks < now ? now_high + 1u : now_high;
}

static void send(uint8_t *message, uint16_t size) {
    hal_uart_send(message, framing_enclose(message, size));
}

static void begin_frame(struct frame *frame, uint32_t now_high, uint32_t now) {
    uint8_t *payload = frame->buffer + FRAMING_BEFORE;
    bool chopped = config.mode == DRIVE_MODE_CHOPPED;
    if (config_singly()) {
        payload[0] = chopped           ? MSG_DRIVE_SAMPLES_CHOPPED
                     : config_packed() ? MSG_DRIVE_SAMPLES_PACKED
                                       : MSG_DRIVE_SAMPLES;
        payload[AT_DRIVE_SAMPLES_ORDER] = frame->order;
        payload[AT_DRIVE_SAMPLES_PLACE] = frame->place;
        payload[AT_DRIVE_SAMPLES_DRIVE] = frame->drive;
    } else {
        payload[0] = chopped ? MSG_FRAME_CHOPPED : config_packed() ? MSG_FRAME_PACKED : MSG_FRAME;
    }
    put_u32(payload + AT_FRAME_SEQUENCE, frame->sequence);
    put_u32(payload + AT_FRAME_TICKS, frame->started);
    put_u32(payload + AT_FRAME_TICKS + 4u, high_of(frame->started, now_high, now));
    put_u16(payload + AT_FRAME_CONFIGURATION, config.identity);
    payload[AT_FRAME_FLAGS] = frame->flags;
    put_u16(payload + AT_FRAME_DROPS, frame->drops);
    send(frame->buffer, frame->size);
}

/* A small message before a frame. */
static void begin_next(uint32_t now_high, uint32_t now) {
    if (small_size != 0u) {
        send(buffer, small_size);
        under_way = SMALL;
        return;
    }
    hal_lock();
    struct frame *frame = scan_take();
    hal_unlock();
    if (frame != NULL) {
        begin_frame(frame, now_high, now);
        under_way = FRAME;
    }
}

void link_send(uint32_t now_high, uint32_t now) {
    note_sent();
    if (under_way == NOTHING) {
        begin_next(now_high, now);
    }
}

bool link_sent(void) {
    return link_free() && under_way == NOTHING && hal_uart_sent();
}
