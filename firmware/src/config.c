#include "config.h"

#include "bytes.h"
#include "hal.h"
#include "protocol.h"

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
    uint32_t current = hal_current();
    if (current == CURRENT_DAMAGED || current > get_u32(payload + AT_SET_SCAN_CURRENT_LIMIT)) {
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
    config.mode = DRIVE_MODE_DIRECT;
    config.periods = 0u;
    config.frequency = 0u;
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
        drive->mask = (channel_set)get_u32(at + AT_DRIVE_MASK);
        at += SIZE_DRIVE;
    }
    return verdict(RESULT_OK, 0u);
}

static bool packs(uint8_t format) {
    return format == FORMAT_PACKED || format == FORMAT_DRIVES_PACKED;
}

bool config_packed(void) {
    return packs(config.format);
}

bool config_singly(void) {
    return config.format >= FORMAT_DRIVES;
}

struct verdict config_set_format(const uint8_t *payload) {
    uint8_t format = payload[AT_SET_FORMAT_FORMAT];
    if (!announced(get_u16(payload + AT_SET_FORMAT_CONFIGURATION))) {
        return verdict(RESULT_WRONG_CONFIGURATION, 0u);
    }
    if (format > FORMAT_DRIVES_PACKED || (packs(format) && (config.oversampling != 1u || ADC_BITS != 10u))) {
        return bad(FIELD_SET_FORMAT_FORMAT);
    }
    config.format = format;
    return verdict(RESULT_OK, 0u);
}

struct verdict config_set_mode(const uint8_t *payload) {
    uint8_t mode = payload[AT_SET_MODE_MODE];
    uint16_t frequency = get_u16(payload + AT_SET_MODE_FREQUENCY);
    uint8_t periods = payload[AT_SET_MODE_PERIODS];
    bool chopped = mode == DRIVE_MODE_CHOPPED;
    if (!announced(get_u16(payload + AT_SET_MODE_CONFIGURATION))) {
        return verdict(RESULT_WRONG_CONFIGURATION, 0u);
    }
    if (mode != DRIVE_MODE_DIRECT && !chopped) {
        return bad(FIELD_SET_MODE_MODE);
    }
    if (chopped ? frequency < LEAST_CHOP_HZ : frequency != 0u) {
        return bad(FIELD_SET_MODE_FREQUENCY);
    }
    if (frequency > hal_board->most_chop_hz) {
        return verdict(RESULT_CHOP_TOO_FAST, hal_board->most_chop_hz);
    }
    if (chopped ? periods == 0u || config.oversampling % (2u * periods) != 0u : periods != 0u) {
        return bad(FIELD_SET_MODE_PERIODS);
    }
    config.mode = mode;
    config.frequency = frequency;
    config.periods = periods;
    return verdict(RESULT_OK, 0u);
}

uint8_t config_directions(void) {
    return config.mode == DRIVE_MODE_CHOPPED ? (uint8_t)(2u * config.periods) : 1u;
}

uint8_t config_conversions(void) {
    return (uint8_t)(config.oversampling / config_directions());
}

uint16_t config_ticks(uint32_t us) {
    return (uint16_t)((us + US_PER_TICK - 1u) / US_PER_TICK + 1u);
}

static uint8_t channels_of(const struct drive *drive) {
    uint8_t channels = 0u;
    for (channel_set rest = drive->mask; rest != 0u; rest &= (channel_set)(rest - 1u)) {
        channels++;
    }
    return channels;
}

/* Hz: of the fastest alternating drive in which `channels` can be read in half a period. */
static uint16_t chop_limit(uint8_t channels) {
    uint32_t conversion = hal_board->conversion_ns + (uint32_t)hal_board->clock_ns * config.prescaler;
    uint32_t half = hal_board->half_ns + UINT32_C(1000) * config.dead_time +
                    UINT32_C(1000) * US_PER_TICK * config_ticks(config.settling) +
                    channels * (hal_board->sample_ns + config_conversions() * conversion);
    uint32_t limit = UINT32_C(500000000) / half;
    return limit < hal_board->most_chop_hz ? (uint16_t)limit : hal_board->most_chop_hz;
}

/* Whether the electrode before the sink, the last one before the first, is the source: a board that
   reads against it cannot read this drive. */
static bool drives_reference(uint8_t source, uint8_t sink, uint8_t electrodes) {
    return source == (sink == 0u ? electrodes : sink) - 1u;
}

/* How many electrodes the skin has, by the highest channel of its drives. */
static uint8_t electrodes_of(void) {
    uint8_t most = 0u;
    for (uint16_t number = 0u; number < config.n_drives; number++) {
        const struct drive *drive = &config.drives[number];
        most = drive->source > most ? drive->source : most;
        most = drive->sink > most ? drive->sink : most;
        while (most + 1u < CHANNELS && drive->mask >> (most + 1u) != 0u) {
            most++;
        }
    }
    return (uint8_t)(most + 1u);
}

/* The first drive that this board cannot read, or the number of drives. */
static uint16_t unreadable_drive(bool chopped) {
    uint16_t number = 0u;
    uint8_t electrodes = electrodes_of();
    for (; hal_against_neighbour() && number < config.n_drives; number++) {
        const struct drive *drive = &config.drives[number];
        if (drives_reference(drive->source, drive->sink, electrodes) ||
            (chopped && drives_reference(drive->sink, drive->source, electrodes))) {
            return number;
        }
    }
    return config.n_drives;
}

struct verdict config_check_start(uint16_t identity) {
    if (!announced(identity)) {
        return verdict(RESULT_WRONG_CONFIGURATION, 0u);
    }
    bool chopped = config.mode == DRIVE_MODE_CHOPPED;
    uint16_t values = 0u;
    uint8_t most = 0u;
    for (uint16_t number = 0u; number < config.n_drives; number++) {
        if (config.drives[number].source == UNSET) {
            return verdict(RESULT_INCOMPLETE, number);
        }
        uint8_t channels = channels_of(&config.drives[number]);
        most = channels > most ? channels : most;
        values = (uint16_t)(values + (chopped ? 2u * channels : channels));
    }
    if (values > MOST_SAMPLES) {
        return verdict(RESULT_TOO_MANY_SAMPLES, chopped ? MOST_SAMPLES / 2u : MOST_SAMPLES);
    }
    uint16_t unreadable = unreadable_drive(chopped);
    if (unreadable != config.n_drives) {
        return verdict(RESULT_DRIVEN_REFERENCE, unreadable);
    }
    if (chopped && config.frequency > chop_limit(most)) {
        return verdict(RESULT_CHOP_TOO_FAST, chop_limit(most));
    }
    return verdict(RESULT_OK, 0u);
}

struct verdict config_check_order(const uint8_t *payload, uint8_t size) {
    uint8_t count = (uint8_t)(size - SIZE_SET_ORDER);
    const uint8_t *drives = payload + SIZE_SET_ORDER;
    if (!announced(get_u16(payload + AT_SET_ORDER_CONFIGURATION))) {
        return verdict(RESULT_WRONG_CONFIGURATION, 0u);
    }
    if ((payload[AT_SET_ORDER_ORDER] == 0u) != (count == 0u)) {
        return bad(FIELD_SET_ORDER_ORDER);
    }
    for (uint8_t number = 0u; number < count; number++) {
        if (drives[number] >= config.n_drives) {
            return bad(FIELD_SET_ORDER_DRIVES);
        }
    }
    return verdict(RESULT_OK, 0u);
}
