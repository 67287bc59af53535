/* The skin before an emulated converter: a memory that the host's side writes at any time. */
#ifndef TOMOSKIN_SKIN_H
#define TOMOSKIN_SKIN_H

#include <stdint.h>

#define SKIN_MOST 32u
#define SKIN_MAGIC UINT64_C(0x31306E696B736F74) /* "toskin01" */

/* What is wrong with the board, so that its check can be tested; all 0: nothing. Masks have a bit for
   each channel; of stuck transistors the lowest counts, on one side at a time. */
struct skin_faults {
    uint32_t high_open; /* never connects its channel to the current */
    uint32_t low_open;  /* nor to ground */
    uint32_t high_stuck; /* always does */
    uint32_t low_stuck;
    uint8_t source[SKIN_MOST]; /* 1 + the channel that is connected, or read, instead; 0: its own */
    uint8_t sink[SKIN_MOST];
    uint8_t reading[SKIN_MOST];
};

/* A seqlock: `sequence` is odd while the rest is written. Python: tomoskin_emulator.memory. */
struct skin_memory {
    uint64_t magic;
    uint32_t sequence;
    uint32_t n;          /* electrodes */
    double current;      /* A */
    double compliance;   /* V, most across the driven pair */
    double gain;         /* code = (gain V + offset) levels / reference */
    double offset;       /* V */
    double reference;    /* V */
    double levels;       /* 2^bits */
    double noise;        /* LSB, standard deviation of one conversion */
    double resistance[SKIN_MOST * SKIN_MOST]; /* ohm, transfer, row by row, n by n */
    struct skin_faults faults;
    double potential[SKIN_MOST]; /* V that each electrode has by itself, whatever flows */
    double offset_of[SKIN_MOST]; /* V of each channel's amplifier, at its input */
    double double_layer; /* F of each electrode, which polarises; 0: none does */
    double leak;         /* ohm across it */
};

/* Map `path`, or exit with a sentence. */
const struct skin_memory *skin_open(const char *path);

/* A skin for want of another: each electrode at the end of a resistor of 1 + e ohm to one point. */
const struct skin_memory *skin_star(void);

/* The current has flowed from `source` to `sink` for so many seconds, and has charged their double
   layers, which leak; SKIN_MOST or more for either: none has flowed. */
void skin_pass(const struct skin_memory *skin, unsigned source, unsigned sink, double seconds);

/* V of a channel against the sink; 0 beyond the skin's electrodes or with nothing connected. */
double skin_volts(const struct skin_memory *skin, unsigned source, unsigned sink, unsigned channel);

/* One conversion. */
uint16_t skin_code(const struct skin_memory *skin, unsigned source, unsigned sink,
                   unsigned channel);

#endif
