/* The converter runs without a pause from the first sample of a drive to the last, so that the
   instants of sampling stand on a grid of 2 us whatever interrupts do; DMA fetches what it gives,
   in turn, and the converter's FIFO holds four conversions while the interrupt is late. */
#include "converter.h"

#include "clocks.h"
#include "hal.h"
#include "limits.h"
#include "pins.h"
#include "rp2040.h"
#include "scan.h"

#include <stdbool.h>
#include <stdint.h>

/* After a change of channel: the one under way is of the old channel, and the next one gives the
   multiplexer its time. */
#define DROPPED 2u
#define US_PER_CONVERSION 2u
#define LATENESS_US 4u
#define RUNNING (ADC_ENABLE | ADC_START_MANY | (AMPLIFIER_INPUT << ADC_INPUT_SHIFT))

static uint16_t codes[DROPPED + MOST_OVERSAMPLING];
static uint8_t conversions;
static bool started; /* in this interrupt */

void converter_start(void) {
    clocks_unreset(RESET_ADC | RESET_DMA);
    REGISTER(ADC_CS) = ADC_ENABLE;
    while ((REGISTER(ADC_CS) & ADC_READY) == 0u) {
    }
    REGISTER(ADC_DIV) = 0u; /* without a pause */
    REGISTER(ADC_FCS) = FCS_ENABLE | FCS_DREQ | FCS_THRESHOLD_1 | FCS_FLAGS;
    REGISTER(DMA_INTE0) = 1u;
}

void hal_adc_prepare(uint8_t prescaler, uint8_t wanted) {
    (void)prescaler; /* its clock has one rate */
    conversions = wanted;
}

uint16_t hal_adc_ticks(void) {
    return (uint16_t)(((DROPPED + conversions) * US_PER_CONVERSION + LATENESS_US) / US_PER_TICK + 1u);
}

static bool runs(void) {
    return (REGISTER(ADC_CS) & ADC_START_MANY) != 0u;
}

/* Whatever was converted after the last sample of a drive. */
static void drain(void) {
    while ((REGISTER(ADC_FCS) & FCS_EMPTY) == 0u) {
        (void)REGISTER(ADC_FIFO);
    }
}

void hal_adc_start(uint8_t channel) {
    uint32_t address = (uint32_t)channel << READ_SHIFT;
    REGISTER(SIO_OUT_XOR) = (REGISTER(SIO_OUT) ^ address) & (ADDRESS_MASK << READ_SHIFT);
    if (!runs()) {
        drain();
    }
    REGISTER(DMA_READ) = ADC_FIFO;
    REGISTER(DMA_WRITE) = (uint32_t)codes;
    REGISTER(DMA_COUNT) = DROPPED + conversions;
    REGISTER(DMA_CTRL_TRIG) = DMA_ENABLE | DMA_SIZE_16 | DMA_INCREMENT_WRITE | DMA_FROM_ADC;
    REGISTER(ADC_CS) = RUNNING;
    started = true;
}

static void stop(void) {
    REGISTER(ADC_CS) = ADC_ENABLE;
}

void hal_adc_cancel(void) {
    stop();
    REGISTER(DMA_INTE0) = 0u; /* an aborted channel may call: RP2040-E13 */
    REGISTER(DMA_ABORT) = 1u;
    while ((REGISTER(DMA_CTRL) & DMA_BUSY) != 0u) {
    }
    REGISTER(DMA_INTS0) = 1u;
    REGISTER(NVIC_CLEAR) = 1u << IRQ_DMA_0;
    REGISTER(DMA_INTE0) = 1u;
}

void on_samples(void) {
    uint32_t sum = 0u;
    REGISTER(DMA_INTS0) = 1u;
    for (uint8_t number = 0u; number < conversions; number++) {
        sum += codes[DROPPED + number];
    }
    started = false;
    scan_on_sample((uint16_t)sum);
    if (!started) {
        stop();
    }
}
