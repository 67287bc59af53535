/* The machine as a Raspberry Pi Pico: RP2040, one core at 125 MHz, all code in RAM.

   The scan's interrupts come before all others; alarm 0 is the scan's timer, alarm 1 wakes the main
   loop every 10 ms. SysTick counts cycles. */
#include "hal.h"

#include "clocks.h"
#include "converter.h"
#include "flash.h"
#include "limits.h"
#include "pins.h"
#include "protocol.h"
#include "rp2040.h"
#include "scan.h"
#include "usb.h"

#define CYCLES_PER_US 125u
#define SYSTICK_MASK 0xFFFFFFu
#define WAKE_US 10000u
#define WATCHDOG_US 120000u
#define WATCHDOG_PER_US 2u /* it counts twice each tick: RP2040-E1 */
#define EARLY_US 2u        /* that an alarm comes before its time: the interrupt waits for the cycle */
#define LOWEST 0xC0u

static volatile bool awake;
static uint32_t reset_cause;
static uint32_t timer_from;   /* cycle at which the scan's timer was set */
static uint32_t timer_cycles; /* and how long it is to be */

static uint32_t cycles_since(uint32_t from) {
    return (from - REGISTER(SYSTICK_NOW)) & SYSTICK_MASK; /* it counts down */
}

static void set_up_pins(void) {
    REGISTER(SIO_OUT_CLR) = OUTPUTS;
    REGISTER(SIO_OUT_SET) = LATCH | (1u << REGULATOR_PIN);
    REGISTER(SIO_OE_SET) = OUTPUTS | (1u << REGULATOR_PIN);
    for (uint32_t pin = FIRST_OUTPUT; pin <= LAST_OUTPUT; pin++) {
        REGISTER(PAD(pin)) = PAD_OUTPUT;
        REGISTER(GPIO_CTRL(pin)) = GPIO_SIO;
    }
    REGISTER(GPIO_CTRL(REGULATOR_PIN)) = GPIO_SIO;
    REGISTER(PAD(AMPLIFIER_PIN)) = PAD_ANALOGUE;
}

static uint8_t cause(void) {
    if (REGISTER(WATCHDOG_REASON) != 0u) {
        return RESET_WATCHDOG;
    }
    uint32_t chip = REGISTER(CHIP_RESET);
    if ((chip & CHIP_HAD_RUN_PIN) != 0u) {
        return RESET_EXTERNAL;
    }
    return (chip & CHIP_HAD_POWER_ON) != 0u ? RESET_POWER : RESET_UNKNOWN;
}

static void set_up_interrupts(void) {
    /* TIMER_0 and DMA_0 at 0, the highest; TIMER_1, USB and SEND at the lowest. */
    REGISTER(NVIC_PRIORITY(0u)) = LOWEST << 8;
    REGISTER(NVIC_PRIORITY(1u)) = LOWEST << 8;
    REGISTER(NVIC_PRIORITY(2u)) = 0u;
    REGISTER(NVIC_PRIORITY(6u)) = LOWEST << 16;
    REGISTER(TIMER_INTE) = 3u;
    REGISTER(NVIC_ENABLE) = (1u << IRQ_TIMER_0) | (1u << IRQ_TIMER_1) | (1u << IRQ_USB) |
                            (1u << IRQ_DMA_0) | (1u << IRQ_SEND);
    REGISTER(TIMER_ALARM(1u)) = REGISTER(TIMER_RAW_LOW) + WAKE_US;
}

/* Its own converter drops two conversions of 2 us after a change of channel, that of the front end three;
   a third of slack. */
#define BOARD(sample)                                                                                     \
    {.name = "Raspberry Pi Pico", .most_chop_hz = 5000u, .half_ns = 6000u, .sample_ns = (sample),         \
     .conversion_ns = 2000u, .clock_ns = 0u}
static const struct hal_board own_converter = BOARD(6000u);
static const struct hal_board front_end = BOARD(8000u);
const struct hal_board *hal_board = &own_converter;

void hal_init(void) {
    clocks_unreset(RESET_IO_BANK0 | RESET_PADS_BANK0);
    set_up_pins();
    reset_cause = cause();
    flash_read_identity();
    clocks_start();
    REGISTER(SYSTICK_RELOAD) = SYSTICK_MASK;
    REGISTER(SYSTICK_NOW) = 0u;
    REGISTER(SYSTICK_CTRL) = 5u;
    hal_board = converter_start() ? &front_end : &own_converter;
    usb_start();
    REGISTER(PSM_WDSEL) = PSM_ALL_BUT_OSCILLATORS;
    hal_watchdog_kick();
    REGISTER(WATCHDOG_CTRL) = WATCHDOG_ENABLE;
    set_up_interrupts();
    __asm volatile("cpsie i" ::: "memory");
}

uint8_t hal_reset_cause(void) {
    return (uint8_t)reset_cause;
}

void hal_unique_id(uint8_t *id) {
    flash_unique_id(id);
}

uint32_t hal_current(void) {
    return flash_current();
}

bool hal_against_neighbour(void) {
    return true; /* U5 of its front end goes by the sink's address */
}

void hal_switches_disable(void) {
    REGISTER(SIO_OUT_CLR) = SOURCE_ENABLE | SINK_ENABLE;
}

void hal_switches_address(uint8_t source, uint8_t sink) {
    uint32_t mask = (ADDRESS_MASK << SOURCE_SHIFT) | (ADDRESS_MASK << SINK_SHIFT);
    uint32_t wanted = ((uint32_t)source << SOURCE_SHIFT) | ((uint32_t)sink << SINK_SHIFT);
    REGISTER(SIO_OUT_XOR) = (REGISTER(SIO_OUT) ^ wanted) & mask;
}

void hal_switches_latch(void) {
    REGISTER(SIO_OUT_CLR) = LATCH;
    hal_delay_us(1u); /* a demultiplexer of the 4000 series needs 0.2 us */
    REGISTER(SIO_OUT_SET) = LATCH;
}

void hal_switches_enable(uint8_t source, uint8_t sink) {
    (void)source; /* the latches hold them */
    (void)sink;
    REGISTER(SIO_OUT_SET) = SOURCE_ENABLE | SINK_ENABLE;
}

uint32_t hal_ticks(void) {
    uint32_t low, high;
    do { /* both halves of one moment, whatever interrupts */
        high = REGISTER(TIMER_RAW_HIGH);
        low = REGISTER(TIMER_RAW_LOW);
    } while (high != REGISTER(TIMER_RAW_HIGH));
    return (high << 30) | (low >> 2);
}

void hal_listen(void) {} /* the line waits by itself */

void hal_delay_us(uint16_t us) {
    uint32_t from = REGISTER(SYSTICK_NOW);
    while (cycles_since(from) < us * CYCLES_PER_US) {
    }
}

void hal_timer_set(uint16_t ticks) {
    timer_from = REGISTER(SYSTICK_NOW);
    uint32_t us = (uint32_t)ticks * US_PER_TICK;
    timer_cycles = us * CYCLES_PER_US;
    REGISTER(TIMER_ALARM(0u)) = REGISTER(TIMER_RAW_LOW) + us - EARLY_US;
}

void hal_timer_extend(uint16_t ticks) {
    uint32_t gone = cycles_since(timer_from);
    timer_cycles = (uint32_t)ticks * US_PER_TICK * CYCLES_PER_US;
    uint32_t left = gone < timer_cycles ? (timer_cycles - gone) / CYCLES_PER_US : 0u;
    /* the alarm must lie ahead, or it comes in an hour */
    REGISTER(TIMER_ALARM(0u)) = REGISTER(TIMER_RAW_LOW) + (left > 2u * EARLY_US ? left - EARLY_US : EARLY_US);
}

void hal_timer_cancel(void) {
    REGISTER(TIMER_ARMED) = 1u;
    REGISTER(TIMER_INTR) = 1u;
    REGISTER(NVIC_CLEAR) = 1u << IRQ_TIMER_0;
}

void on_scan_timer(void) {
    REGISTER(TIMER_INTR) = 1u;
    while (cycles_since(timer_from) < timer_cycles) {
    }
    scan_on_timer();
}

void on_wake_timer(void) {
    REGISTER(TIMER_INTR) = 2u;
    REGISTER(TIMER_ALARM(1u)) = REGISTER(TIMER_RAW_LOW) + WAKE_US;
    awake = true;
}

uint16_t hal_crc16(uint16_t crc, uint8_t byte) {
    return crc16_step(crc, byte);
}

void hal_lock(void) {
    __asm volatile("cpsid i" ::: "memory");
}

void hal_unlock(void) {
    __asm volatile("cpsie i" ::: "memory");
}

void hal_wake(void) {
    awake = true;
}

void hal_idle(void) {
    hal_lock();
    while (!awake) {
        __asm volatile("wfi" ::: "memory"); /* it wakes though locked */
        hal_unlock();
        __asm volatile("isb" ::: "memory");
        hal_lock();
    }
    awake = false;
    hal_unlock();
}

void hal_watchdog_kick(void) {
    REGISTER(WATCHDOG_LOAD) = WATCHDOG_US * WATCHDOG_PER_US;
}
