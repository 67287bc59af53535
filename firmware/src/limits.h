/* What this firmware can hold: static memory, for the 8 kB of an ATmega2560 unless a board has more. */
#ifndef TOMOSKIN_LIMITS_H
#define TOMOSKIN_LIMITS_H

#include <assert.h>
#include <stdint.h>

#ifndef CHANNELS
#define CHANNELS 16u /* a board with 8 or 32: make CHANNELS=8 */
#endif

#ifndef MOST_DRIVES
#define MOST_DRIVES 128u
#endif
static_assert(MOST_DRIVES <= 255u, "the number of a drive has eight bits");
#ifndef MOST_SAMPLES
#define MOST_SAMPLES 448u /* values in a frame: a chopped one has two a sample */
#endif
#define MOST_SETTLING_US UINT32_C(100000)
#define LEAST_CHOP_HZ 10u

#ifndef ADC_BITS
#define ADC_BITS 10u
#endif
#define MOST_OVERSAMPLING (ADC_BITS > 10u ? 16u : 64u) /* the sum fits into 16 bits */
static_assert(ADC_BITS <= 12u, "sixteen conversions fit into a sample");
#define FIRST_BAUD UINT32_C(1000000)

#define FIRMWARE_MAJOR 1u
#define FIRMWARE_MINOR 3u
#define FIRMWARE_PATCH 0u

/* Bit e: channel e. */
#if CHANNELS <= 16u
typedef uint16_t channel_set;
#else
typedef uint32_t channel_set;
#endif
static_assert(CHANNELS <= 32u, "a drive's mask has 32 bits");

#endif
