#include "config.h"

#include "bytes.h"
#include "hal.h"
#include "protocol.h"

#include <stdbool.h>

struct config config;

static struct verdict verdict(uint8_t result, uint16_t detail) {
    struct verdict said = {result, detail};
    return said;
}

static struct verdict bad(uint8_t field) {
    return verdict(RESULT_BAD_VALUE, field);
}

void config_forget(void) {
    config.identity = 0u;
    config.n_drives = 0u;
}

static bool prescaler_known(uint8_t prescaler) {
    return prescaler == 16u || prescaler == 32u || prescaler == 64u || prescaler == 128u;
}

struct verdict config_set_scan(const uint8_t *payload) {
    uint16_t identity = get_u16(payload + AT_SET_SCAN_CONFIGURATION);
    uint16_t n_drives = get_u16(payload + AT_SET_SCAN_N_DRIVES);
    uint32_t settling = get_u32(payload + AT_SET_SCAN_SETTLING);
    uint8_t oversampling = payload[AT_SET_SCAN_OVERSAMPLING];
    uint8_t prescaler = payload[AT_SET_SCAN_PRESCALER];
    if (n_drives > MOST_DRIVES) {
        return verdict(RESULT_TOO_MANY_DRIVES, MOST_DRIVES);
    }
    if (hal_current() > get_u32(payload + AT_SET_SCAN_CURRENT_LIMIT)) {
        return verdict(RESULT_CURRENT_TOO_HIGH, 0u);
    }
    if (identity == 0u) {
        return bad(FIELD_SET_SCAN_CONFIGURATION);
    }
    if (n_drives == 0u) {
        return bad(FIELD_SET_SCAN_N_DRIVES);
    }
    if (settling > MOST_SETTLING_US) {
        return bad(FIELD_SET_SCAN_SETTLING);
    }
    if (oversampling == 0u || oversampling > MOST_OVERSAMPLING) {
        return bad(FIELD_SET_SCAN_OVERSAMPLING);
    }
    if (!prescaler_known(prescaler)) {
        return bad(FIELD_SET_SCAN_PRESCALER);
    }
    config.identity = identity;
    config.n_drives = n_drives;
    config.settling = settling;
    config.dead_time = get_u16(payload + AT_SET_SCAN_DEAD_TIME);
    config.oversampling = oversampling;
    config.prescaler = prescaler;
    config.format = FORMAT_SIXTEEN;
    config.current_limit = get_u32(payload + AT_SET_SCAN_CURRENT_LIMIT);
    for (uint16_t number = 0u; number < n_drives; number++) {
        config.drives[number] = (struct drive){UNSET, UNSET, 0u};
    }
    return verdict(RESULT_OK, 0u);
}

static bool announced(uint16_t identity) {
    return config.identity != 0u && identity == config.identity;
}

static uint8_t drive_result(const uint8_t *at) {
    uint8_t source = at[AT_DRIVE_SOURCE];
    uint8_t sink = at[AT_DRIVE_SINK];
    uint32_t beyond = CHANNELS < 32u ? get_u32(at + AT_DRIVE_MASK) >> CHANNELS : 0u;
    if (source == sink) {
        return RESULT_SAME_ELECTRODE;
    }
    if (source >= CHANNELS || sink >= CHANNELS || beyond != 0u) {
        return RESULT_NO_SUCH_CHANNEL;
    }
    return RESULT_OK;
}

struct verdict config_set_pattern(const uint8_t *payload, uint8_t size) {
    uint16_t first = get_u16(payload + AT_SET_PATTERN_FIRST);
    uint8_t count = (uint8_t)((size - SIZE_SET_PATTERN) / SIZE_DRIVE);
    const uint8_t *at = payload + SIZE_SET_PATTERN;
    if (!announced(get_u16(payload + AT_SET_PATTERN_CONFIGURATION))) {
        return verdict(RESULT_WRONG_CONFIGURATION, 0u);
    }
    if (count == 0u || first >= config.n_drives || count > config.n_drives - first) {
        return bad(FIELD_SET_PATTERN_FIRST);
    }
    for (uint8_t number = 0u; number < count; number++) {
        uint8_t result = drive_result(at + SIZE_DRIVE * number);
        if (result != RESULT_OK) {
            return verdict(result, (uint16_t)(first + number));
        }
    }
    for (struct drive *drive = config.drives + first; count != 0u; count--, drive++) {
        drive->source = at[AT_DRIVE_SOURCE];
        drive->sink = at[AT_DRIVE_SINK];
        drive->mask = get_u16(at + AT_DRIVE_MASK);
        at += SIZE_DRIVE;
    }
    return verdict(RESULT_OK, 0u);
}

struct verdict config_set_format(const uint8_t *payload) {
    uint8_t format = payload[AT_SET_FORMAT_FORMAT];
    if (!announced(get_u16(payload + AT_SET_FORMAT_CONFIGURATION))) {
        return verdict(RESULT_WRONG_CONFIGURATION, 0u);
    }
    if (format > FORMAT_PACKED || (format == FORMAT_PACKED && (config.oversampling != 1u || ADC_BITS != 10u))) {
        return bad(FIELD_SET_FORMAT_FORMAT);
    }
    config.format = format;
    return verdict(RESULT_OK, 0u);
}

struct verdict config_check_start(uint16_t identity) {
    if (!announced(identity)) {
        return verdict(RESULT_WRONG_CONFIGURATION, 0u);
    }
    uint16_t samples = 0u;
    for (uint16_t number = 0u; number < config.n_drives; number++) {
        if (config.drives[number].source == UNSET) {
            return verdict(RESULT_INCOMPLETE, number);
        }
        for (channel_set rest = config.drives[number].mask; rest != 0u; rest &= (channel_set)(rest - 1u)) {
            samples++;
        }
    }
    if (samples > MOST_SAMPLES) {
        return verdict(RESULT_TOO_MANY_SAMPLES, MOST_SAMPLES);
    }
    return verdict(RESULT_OK, 0u);
}
