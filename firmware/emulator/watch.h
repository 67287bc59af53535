/* What the emulator sees of its board, in a file that a test maps: -w FILE. */
#ifndef TOMOSKIN_WATCH_H
#define TOMOSKIN_WATCH_H

#include <stdint.h>

#define WATCH_WORDS 131072u /* of flash */
#define WATCH_CHANNELS 16u

/* Cycles are of the simulated clock. Python: tests/emulator/watch.py. */
struct watch {
    uint64_t cycle;
    uint64_t connected;    /* 1: a source or a sink is */
    uint64_t since;        /* cycle of the last change of that */
    uint64_t longest_on;   /* cycles that a drive was on, at most */
    uint64_t shortest_off; /* and cycles between two drives, at least */
    uint64_t resets;       /* after power-on */
    uint64_t lowest_stack; /* address that the stack pointer has come down to */
    uint64_t said;         /* cycles from the end of a drive to that of the last message */
    uint64_t longest_deaf; /* cycles without a look at the line, at most, while it scans */
    uint64_t spent[WATCH_WORDS]; /* cycles in the instruction at each word */
    int64_t net[WATCH_CHANNELS]; /* of pairs, by the lower channel: cycles from the other one to it, less
                                    those from it to the other */
};

/* A memory that shows in `path`, or exit with a sentence. */
struct watch *watch_make(const char *path);

#endif
