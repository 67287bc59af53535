#include "skin.h"

#include <fcntl.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

static _Noreturn void give_up(const char *path, const char *why) {
    (void)fprintf(stderr, "skin memory %s: %s\n", path, why);
    exit(1);
}

const struct skin_memory *skin_open(const char *path) {
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        give_up(path, "cannot be opened");
    }
    const struct skin_memory *skin =
        mmap(NULL, sizeof *skin, PROT_READ, MAP_SHARED, file, 0);
    off_t size = lseek(file, 0, SEEK_END);
    (void)close(file);
    if (skin == MAP_FAILED || size < (off_t)sizeof *skin || skin->magic != SKIN_MAGIC) {
        give_up(path, "is no skin memory of this version");
    }
    return skin;
}

const struct skin_memory *skin_star(void) {
    static struct skin_memory star = {
        .magic = SKIN_MAGIC, .n = SKIN_MOST, .current = 0.1, .compliance = 1e9,
        .gain = 1.0, .reference = 5.0, .levels = 1024.0,
    };
    for (unsigned e = 0; e < SKIN_MOST; e++) {
        star.resistance[e * SKIN_MOST + e] = 1.0 + e;
    }
    return &star;
}

static double layer[SKIN_MOST]; /* V of the double layers */

void skin_pass(const struct skin_memory *skin, unsigned source, unsigned sink, double seconds) {
    if (skin->double_layer <= 0.0) {
        return;
    }
    bool flows = source < SKIN_MOST && sink < SKIN_MOST;
    double limit = flows ? skin->current * skin->leak : 0.0; /* after all time */
    double kept = exp(-seconds / (skin->double_layer * skin->leak));
    for (unsigned e = 0; e < SKIN_MOST; e++) {
        double end = e == source ? limit : e == sink ? -limit : 0.0;
        layer[e] = end + (layer[e] - end) * kept;
    }
}

static const double *row(const struct skin_memory *skin, unsigned electrode) {
    return skin->resistance + (size_t)electrode * skin->n;
}

/* The current that a stuck transistor of `also` takes over from `main`, on the side that is
   connected to one line: both then have one potential. `far`: the other side's electrode. */
static double share(const struct skin_memory *skin, unsigned main, unsigned also, unsigned far) {
    const double *m = row(skin, main);
    const double *a = row(skin, also);
    double loop = m[main] - 2.0 * m[also] + a[also];
    return also == main || loop <= 0.0 ? 0.0 : (m[main] - m[far] - a[main] + a[far]) / loop;
}

/* The electrodes that are connected on one side: that of `channel`, and a stuck one; `SKIN_MOST`
   where there is none. */
struct side {
    unsigned main;
    unsigned also;
};

static struct side side_of(unsigned channel, const uint8_t *map, uint32_t open, uint32_t stuck) {
    unsigned electrode = map[channel] != 0u ? map[channel] - 1u : channel;
    unsigned also = stuck != 0u ? (unsigned)__builtin_ctz(stuck) : SKIN_MOST;
    if ((open >> electrode & 1u) != 0u) {
        electrode = also;
    }
    return (struct side){electrode, also < SKIN_MOST ? also : electrode};
}

static double volts_now(const struct skin_memory *skin, unsigned source, unsigned sink,
                        unsigned channel) {
    unsigned n = skin->n;
    if (n > SKIN_MOST || source >= n || sink >= n || channel >= n) {
        return 0.0;
    }
    const struct skin_faults *faults = &skin->faults;
    struct side high = side_of(source, faults->source, faults->high_open, faults->high_stuck);
    struct side low = side_of(sink, faults->sink, faults->low_open, faults->low_stuck);
    unsigned at = faults->reading[channel] != 0u ? faults->reading[channel] - 1u : channel;
    if (high.main >= n || high.main == low.main || at >= n) {
        return 0.0;
    }
    if (low.main >= n) {
        return skin->compliance;
    }
    double into = share(skin, high.main, high.also, low.main);
    double out = share(skin, low.main, low.also, high.main);
    const double *from[4] = {row(skin, high.main), row(skin, high.also), row(skin, low.main),
                             row(skin, low.also)};
    double part[4] = {1.0 - into, into, out - 1.0, -out};
    double ohms_here = 0.0;
    double ohms_high = 0.0;
    double ohms_low = 0.0;
    for (unsigned k = 0; k < 4; k++) {
        ohms_here += part[k] * from[k][at];
        ohms_high += part[k] * from[k][high.main];
        ohms_low += part[k] * from[k][low.main];
    }
    double amperes = skin->current;
    double load = ohms_high - ohms_low;
    if (amperes * load > skin->compliance) {
        amperes = skin->compliance / load;
    }
    return amperes * (ohms_here - ohms_low) + skin->potential[at] - skin->potential[low.main] +
           layer[at] - layer[low.main];
}

double skin_volts(const struct skin_memory *skin, unsigned source, unsigned sink,
                  unsigned channel) {
    const uint32_t *sequence = &skin->sequence;
    for (;;) {
        uint32_t before = __atomic_load_n(sequence, __ATOMIC_ACQUIRE);
        double volts = volts_now(skin, source, sink, channel);
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if ((before & 1u) == 0u && __atomic_load_n(sequence, __ATOMIC_RELAXED) == before) {
            return volts;
        }
    }
}

/* Nearly normal: twelve uniform numbers (Irwin and Hall), always the same ones. */
static double chance(void) {
    static uint64_t state = UINT64_C(88172645463325252);
    double sum = -6.0;
    for (int i = 0; i < 12; i++) {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        sum += (double)(state >> 11) * 0x1p-53;
    }
    return sum;
}

uint16_t skin_code(const struct skin_memory *skin, unsigned source, unsigned sink,
                   unsigned channel) {
    double input = skin_volts(skin, source, sink, channel);
    input += channel < SKIN_MOST ? skin->offset_of[channel] : 0.0;
    double volts = skin->gain * input + skin->offset;
    double code = volts * skin->levels / skin->reference;
    if (skin->noise > 0.0) {
        code += skin->noise * chance();
    }
    return (uint16_t)fmin(fmax(floor(code), 0.0), skin->levels - 1.0);
}
