#include "commands.h"

#include "bytes.h"
#include "config.h"
#include "framing.h"
#include "hal.h"
#include "link.h"
#include "protocol.h"
#include "scan.h"

#define LEAST_HEARTBEAT_MS 100u
#define MOST_HEARTBEAT_MS 10000u

static struct {
    bool known;
    uint8_t request;
    uint16_t checksum;
    struct verdict verdict;
} last;

static uint16_t heartbeat_ms;
static uint32_t wanted_baud;

void commands_forget_last(void) {
    last.known = false;
}

void commands_reset(void) {
    commands_forget_last();
    config_forget();
    heartbeat_ms = FIRST_HEARTBEAT_MS;
    wanted_baud = 0u;
}

uint32_t commands_heartbeat(void) {
    return heartbeat_ms * TICKS_PER_MS;
}

uint32_t commands_take_baud(void) {
    uint32_t baud = wanted_baud;
    wanted_baud = 0u;
    return baud;
}

static bool is_command(uint8_t type) {
    return type >= MSG_GET_INFO && type <= MSG_GET_LOSSES;
}

static bool right_length(uint8_t type, uint8_t size) {
    switch (type) {
    case MSG_SET_SCAN:
        return size == SIZE_SET_SCAN;
    case MSG_SET_PATTERN:
        return size >= SIZE_SET_PATTERN && (size - SIZE_SET_PATTERN) % SIZE_DRIVE == 0u;
    case MSG_START:
        return size == SIZE_START;
    case MSG_SET_BAUD:
        return size == SIZE_SET_BAUD;
    case MSG_SET_HEARTBEAT:
        return size == SIZE_SET_HEARTBEAT;
    case MSG_GET_PATTERN:
        return size == SIZE_GET_PATTERN;
    case MSG_SET_FORMAT:
        return size == SIZE_SET_FORMAT;
    case MSG_SET_MODE:
        return size == SIZE_SET_MODE;
    case MSG_SET_ORDER:
        return size >= SIZE_SET_ORDER;
    default:
        return size == SIZE_PING; /* only the request id */
    }
}

static void stop(void) {
    hal_lock();
    scan_stop();
    hal_unlock();
}

static struct verdict start(const uint8_t *payload) {
    struct verdict said = config_check_start(get_u16(payload + AT_START_CONFIGURATION));
    if (said.result == RESULT_OK) {
        scan_start();
    }
    return said;
}

static struct verdict set_order(const uint8_t *payload, uint8_t size) {
    struct verdict said = {RESULT_NOT_SINGLY, 0u};
    if (!scan_running() || !config_singly()) {
        return said;
    }
    said = config_check_order(payload, size);
    if (said.result == RESULT_OK) {
        hal_lock();
        scan_order(payload[AT_SET_ORDER_ORDER], payload + SIZE_SET_ORDER,
                   (uint8_t)(size - SIZE_SET_ORDER));
        hal_unlock();
    }
    return said;
}

static struct verdict run_idle(const uint8_t *payload, uint8_t size) {
    struct verdict said = {RESULT_OK, 0u};
    switch (payload[0]) {
    case MSG_SET_SCAN:
        return config_set_scan(payload);
    case MSG_SET_PATTERN:
        return config_set_pattern(payload, size);
    case MSG_SET_FORMAT:
        return config_set_format(payload);
    case MSG_SET_MODE:
        return config_set_mode(payload);
    case MSG_START:
        return start(payload);
    default:
        if (hal_uart_can(get_u32(payload + AT_SET_BAUD_BAUD))) {
            wanted_baud = get_u32(payload + AT_SET_BAUD_BAUD);
        } else {
            said.result = RESULT_BAD_VALUE;
            said.detail = FIELD_SET_BAUD_BAUD;
        }
        return said;
    }
}

static struct verdict set_heartbeat(uint16_t interval) {
    struct verdict said = {RESULT_OK, 0u};
    if (interval < LEAST_HEARTBEAT_MS || interval > MOST_HEARTBEAT_MS) {
        said.result = RESULT_BAD_VALUE;
        said.detail = FIELD_SET_HEARTBEAT_INTERVAL;
    } else {
        heartbeat_ms = interval;
    }
    return said;
}

static struct verdict run(const uint8_t *payload, uint8_t size) {
    struct verdict said = {RESULT_OK, 0u};
    switch (payload[0]) {
    case MSG_PING:
        break;
    case MSG_SAFE_OFF:
        stop();
        config_forget();
        break;
    case MSG_STOP:
        stop();
        break;
    case MSG_SET_HEARTBEAT:
        return set_heartbeat(get_u16(payload + AT_SET_HEARTBEAT_INTERVAL));
    case MSG_SET_ORDER:
        return set_order(payload, size);
    default:
        if (!scan_running()) {
            return run_idle(payload, size);
        }
        said.result = RESULT_BUSY;
    }
    return said;
}

/* Questions change nothing: they are answered whenever they come. */
static bool answer(const uint8_t *payload, uint8_t reset_cause) {
    uint8_t type = payload[0];
    uint8_t request = payload[AT_PING_REQUEST];
    if (type == MSG_GET_INFO) {
        link_say_info(request, reset_cause);
        return true;
    }
    if (type == MSG_GET_BOARD) {
        link_say_board(request);
        return true;
    }
    if (type == MSG_GET_LOSSES) {
        link_say_losses(request);
        return true;
    }
    if (type != MSG_GET_SCAN && type != MSG_GET_PATTERN && type != MSG_GET_MODE) {
        return false;
    }
    uint16_t first = type == MSG_GET_PATTERN ? get_u16(payload + AT_GET_PATTERN_FIRST) : 0u;
    if (config.identity == 0u) {
        link_say_ack(request, type, RESULT_WRONG_CONFIGURATION, 0u);
    } else if (type == MSG_GET_SCAN) {
        link_say_scan(request);
    } else if (type == MSG_GET_MODE) {
        link_say_mode(request);
    } else if (first >= config.n_drives) {
        link_say_ack(request, type, RESULT_BAD_VALUE, FIELD_GET_PATTERN_FIRST);
    } else {
        link_say_pattern(request, first);
    }
    return true;
}

bool commands_take(const uint8_t *payload, uint8_t size, uint8_t reset_cause) {
    if (size < SIZE_PING) {
        return false;
    }
    uint8_t type = payload[0];
    uint8_t request = payload[AT_PING_REQUEST];
    if (!is_command(type)) {
        link_say_ack(request, type, RESULT_UNKNOWN_COMMAND, 0u);
        return false;
    }
    if (!right_length(type, size)) {
        link_say_ack(request, type, RESULT_BAD_LENGTH, 0u);
        return false;
    }
    uint16_t checksum = crc16(payload, size);
    bool again = last.known && last.request == request && last.checksum == checksum;
    last.known = true;
    last.request = request;
    last.checksum = checksum;
    if (answer(payload, reset_cause)) {
        return true;
    }
    if (!again) {
        last.verdict = run(payload, size);
    }
    link_say_ack(request, type, last.verdict.result, last.verdict.detail);
    return true;
}
