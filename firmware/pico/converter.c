/* The converter runs without a pause from the first sample of a drive to the last, so that the
   instants of sampling stand on a grid of 2 us whatever interrupts do; DMA fetches what it gives,
   in turn, and a memory holds conversions while the interrupt is late.

   Where the front end has an ADS7042, the processor's own converter sets the pace: each of its
   conversions makes DMA send a word over SPI, which selects the ADS7042, so that it samples, and brings
   its code. */
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
   multiplexer its time; before an ADS7042, two. */
#define DROPPED 2u
#define DROPPED_OF_FRONT_END 3u
#define US_PER_CONVERSION 2u
#define LATENESS_US 4u
#define BEHIND_US 4u /* the pace: its conversion, and the word */
#define RUNNING (ADC_ENABLE | ADC_START_MANY | (AMPLIFIER_INPUT << ADC_INPUT_SHIFT))
#define FIFO_CONTROL (FCS_ENABLE | FCS_DREQ | FCS_THRESHOLD_1)
#define TO_MEMORY (DMA_ENABLE | DMA_SIZE_16 | DMA_INCREMENT_WRITE)
#define PACE (DMA_ENABLE | DMA_SIZE_16 | DMA1_ALONE | DMA_FROM_ADC)
#define FOR_EVER UINT32_MAX

/* 12.5 MHz of 125; an ADS7042 takes 16. Its word: two zeros, twelve bits, and what follows. */
#define SPI_DIVIDER 10u
#define LEADING_ZEROS 0xC000u
#define CODE(word) ((word) >> 2 & 0xFFFu)

/* So many conversions of the channel before may wait where `dropped` still leaves the multiplexer its time. */
#define MOST_WAITING 1u

static uint16_t codes[DROPPED_OF_FRONT_END + MOST_OVERSAMPLING];
static uint8_t conversions;
static uint8_t dropped = DROPPED;
static bool external; /* an ADS7042 is read */
static bool started;  /* in this interrupt */
static uint16_t late;

static uint16_t exchange(void) {
    REGISTER(SPI_DR) = 0u;
    while ((REGISTER(SPI_SR) & SPI_RECEIVED) == 0u) {
    }
    return (uint16_t)REGISTER(SPI_DR);
}

/* An ADS7042 begins with zeros; where nothing drives the pin it reads ones. The first word after power
   has come up counts for nothing. */
static bool front_end_answers(void) {
    REGISTER(CLK_PERI_CTRL) = CLK_ENABLE;
    clocks_unreset(RESET_SPI0);
    REGISTER(PAD(SPI_FROM_PIN)) = PAD_PULLED_UP;
    for (uint32_t pin = SPI_FROM_PIN; pin <= SPI_CLOCK_PIN; pin++) {
        REGISTER(GPIO_CTRL(pin)) = GPIO_SPI;
    }
    REGISTER(SPI_PRESCALE) = SPI_DIVIDER;
    REGISTER(SPI_CR0) = SPI_16_BITS;
    REGISTER(SPI_CR1) = SPI_ENABLE;
    REGISTER(SPI_DMA) = SPI_DMA_RECEIVE;
    (void)exchange();
    uint16_t both = exchange();
    both = (uint16_t)(both | exchange());
    return (both & LEADING_ZEROS) == 0u;
}

bool converter_start(void) {
    external = front_end_answers();
    dropped = external ? DROPPED_OF_FRONT_END : DROPPED;
    clocks_unreset(RESET_ADC | RESET_DMA);
    REGISTER(ADC_CS) = ADC_ENABLE;
    while ((REGISTER(ADC_CS) & ADC_READY) == 0u) {
    }
    REGISTER(ADC_DIV) = 0u; /* without a pause */
    REGISTER(ADC_FCS) = FIFO_CONTROL | FCS_FLAGS;
    REGISTER(DMA_INTE0) = 1u;
    return external;
}

void hal_adc_prepare(uint8_t prescaler, uint8_t wanted) {
    (void)prescaler; /* its clock has one rate */
    conversions = wanted;
}

uint16_t hal_adc_ticks(void) {
    uint32_t us = (uint32_t)(dropped + conversions) * US_PER_CONVERSION + LATENESS_US;
    return (uint16_t)((us + (external ? BEHIND_US : 0u)) / US_PER_TICK + 1u);
}

static bool runs(void) {
    return (REGISTER(ADC_CS) & ADC_START_MANY) != 0u;
}

/* Whatever was converted after the last sample of a drive, or before a late interrupt. An overflow is
   said by a flag that stays. */
static void drain_own(void) {
    while ((REGISTER(ADC_FCS) & FCS_EMPTY) == 0u) {
        (void)REGISTER(ADC_FIFO);
    }
    REGISTER(ADC_FCS) = FIFO_CONTROL | FCS_FLAGS;
}

/* How many words of the front end have waited; as many as there can be where some were lost. */
static uint32_t drain_front_end(void) {
    uint32_t waited = (REGISTER(SPI_RAW) & SPI_OVERRUN) != 0u ? FOR_EVER / 2u : 0u;
    for (; (REGISTER(SPI_SR) & SPI_RECEIVED) != 0u; waited++) {
        (void)REGISTER(SPI_DR);
    }
    REGISTER(SPI_CLEAR) = SPI_OVERRUN;
    return waited;
}

/* Conversions of the channel before that wait and still count as dropped. Where the interrupt came so
   late that more wait than may, or than fit, they would be taken for the next channel: they are thrown
   away. */
static uint32_t waiting(void) {
    uint32_t waited = 0u;
    bool too_many;
    if (external) {
        waited = drain_front_end();
        too_many = waited > MOST_WAITING;
    } else {
        uint32_t state = REGISTER(ADC_FCS);
        too_many = (state & FCS_OVER) != 0u || FCS_LEVEL(state) > MOST_WAITING;
        if (too_many) {
            drain_own();
        }
    }
    if (too_many) {
        late++;
    }
    return too_many ? 0u : waited;
}

struct losses hal_losses(void) {
    struct losses losses = {late, 0u}; /* USB holds the host's bytes back: none is lost */
    return losses;
}

static void start_pace(void) {
    REGISTER(DMA1_READ) = ADC_FIFO;
    REGISTER(DMA1_WRITE) = SPI_DR;
    REGISTER(DMA1_COUNT) = FOR_EVER;
    REGISTER(DMA1_CTRL_TRIG) = PACE;
}

void hal_adc_start(uint8_t channel) {
    uint32_t address = (uint32_t)channel << READ_SHIFT;
    uint32_t seen = 0u; /* of what is dropped */
    REGISTER(SIO_OUT_XOR) = (REGISTER(SIO_OUT) ^ address) & (ADDRESS_MASK << READ_SHIFT);
    if (runs()) {
        seen = waiting();
    } else {
        drain_own();
        (void)drain_front_end();
        if (external) {
            start_pace();
        }
    }
    REGISTER(DMA_READ) = external ? SPI_DR : ADC_FIFO;
    REGISTER(DMA_WRITE) = (uint32_t)(codes + seen);
    REGISTER(DMA_COUNT) = dropped + conversions - seen;
    REGISTER(DMA_CTRL_TRIG) = TO_MEMORY | (external ? DMA_FROM_SPI : DMA_FROM_ADC);
    REGISTER(ADC_CS) = RUNNING;
    started = true;
}

static void stop(void) {
    REGISTER(ADC_CS) = ADC_ENABLE;
    if (external) {
        REGISTER(DMA_ABORT) = 2u;
        while ((REGISTER(DMA1_CTRL) & DMA_BUSY) != 0u) {
        }
    }
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
        uint16_t code = codes[dropped + number];
        sum += external ? CODE(code) : code;
    }
    started = false;
    scan_on_sample((uint16_t)sum);
    if (!started) {
        stop();
    }
}
