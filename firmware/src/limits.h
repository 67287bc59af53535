/* What this firmware can hold: static memory, chosen for the 8 kB of an ATmega2560. */
#ifndef TOMOSKIN_LIMITS_H
#define TOMOSKIN_LIMITS_H

#include <assert.h>
#include <stdint.h>

#ifndef CHANNELS
#define CHANNELS 16u /* a board with 8: make CHANNELS=8 */
#endif

#define MOST_DRIVES 128u
#define MOST_SAMPLES 400u
#define MOST_SETTLING_US UINT32_C(100000)

#ifndef ADC_BITS
#define ADC_BITS 10u
#endif
#define MOST_OVERSAMPLING (ADC_BITS > 10u ? 16u : 64u) /* the sum fits into 16 bits */
static_assert(ADC_BITS <= 12u, "sixteen conversions fit into a sample");
#define FIRST_BAUD UINT32_C(1000000)

#define FIRMWARE_MAJOR 1u
#define FIRMWARE_MINOR 1u
#define FIRMWARE_PATCH 0u

/* Bit e: channel e. */
typedef uint16_t channel_set;
static_assert(CHANNELS <= 16u, "channel_set has 16 bits");

#endif
