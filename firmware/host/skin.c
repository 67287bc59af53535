#include "skin.h"

#include <fcntl.h>
#include <math.h>
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

static double volts_now(const struct skin_memory *skin, unsigned source, unsigned sink,
                        unsigned channel) {
    unsigned n = skin->n;
    if (n > SKIN_MOST || source >= n || sink >= n || channel >= n) {
        return 0.0;
    }
    const double *r = skin->resistance;
    double at_sink = r[source * n + sink] - r[sink * n + sink];
    double load = r[source * n + source] - r[sink * n + source] - at_sink;
    double amperes = skin->current;
    if (amperes * load > skin->compliance) {
        amperes = skin->compliance / load;
    }
    return amperes * (r[source * n + channel] - r[sink * n + channel] - at_sink);
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
    double volts = skin->gain * skin_volts(skin, source, sink, channel) + skin->offset;
    double code = volts * skin->levels / skin->reference;
    if (skin->noise > 0.0) {
        code += skin->noise * chance();
    }
    return (uint16_t)fmin(fmax(floor(code), 0.0), skin->levels - 1.0);
}
