/* From the boot to main, and the vectors. Until main has set a pin up, all are as reset has left
   them: inputs with pull-downs, so that nothing is connected. */
#include "rp2040.h"
#include "switches.h"

#include <stdint.h>

extern uint32_t stack_top, image_start, image_end, image_source, bss_start, bss_end;

int main(void);
void start(void);
void on_fault(void);
void on_scan_timer(void);
void on_wake_timer(void);
void on_usb(void);
void on_samples(void);
void on_send(void);

typedef void (*vector)(void);

/* What the boot finds: the stack, and where to begin. */
__attribute__((section(".vectors"), used)) static const vector boot_vectors[] = {
    (vector)&stack_top, start};

/* What runs from then on, in RAM. */
__attribute__((section(".ram_vectors"), used, aligned(256))) static const vector vectors[48] = {
    (vector)&stack_top,
    start,
    on_fault,
    on_fault,
    [11] = on_fault,
    [14] = on_fault,
    [15] = on_fault,
    [16 + IRQ_TIMER_0] = on_scan_timer,
    [16 + IRQ_TIMER_1] = on_wake_timer,
    [16 + IRQ_USB] = on_usb,
    [16 + IRQ_DMA_0] = on_samples,
    [16 + IRQ_SEND] = on_send,
};

/* In flash: copies all the rest. */
__attribute__((section(".first"), noreturn, used)) void start(void) {
    uint32_t from = (uint32_t)&image_source;
    for (uint32_t to = (uint32_t)&image_start; to < (uint32_t)&image_end; to += 4u, from += 4u) {
        REGISTER(to) = REGISTER(from);
    }
    for (uint32_t to = (uint32_t)&bss_start; to < (uint32_t)&bss_end; to += 4u) {
        REGISTER(to) = 0u;
    }
    REGISTER(VECTOR_TABLE) = (uint32_t)vectors;
    int (*volatile in_ram)(void) = main; /* too far for a plain call */
    (void)in_ram();
    for (;;) {
    }
}

/* The processor cannot go on: nothing stays connected, and the watchdog does the rest. */
void on_fault(void) {
    switches_off();
    for (;;) {
    }
}
