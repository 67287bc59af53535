#include "clocks.h"

#include "rp2040.h"

#define STARTUP_1_MS 47u /* in 256 periods of the crystal */
#define CRYSTAL_MHZ 12u

void clocks_unreset(uint32_t parts) {
    SET_BITS(RESETS_RESET) = parts;
    CLEAR_BITS(RESETS_RESET) = parts;
    while ((REGISTER(RESETS_DONE) & parts) != parts) {
    }
}

/* 12 MHz times `by`, divided by `first` and `second`. */
static void start_pll(uint32_t pll, uint32_t by, uint32_t first, uint32_t second) {
    REGISTER(pll + PLL_CS) = 1u;
    REGISTER(pll + PLL_FBDIV) = by;
    CLEAR_BITS(pll + PLL_PWR) = PLL_POWER_OFF;
    while ((REGISTER(pll + PLL_CS) & PLL_LOCKED) == 0u) {
    }
    REGISTER(pll + PLL_PRIM) = (first << 16) | (second << 12);
    CLEAR_BITS(pll + PLL_PWR) = PLL_POSTDIV_OFF;
}

void clocks_start(void) {
    REGISTER(XOSC_CTRL) = XOSC_1_TO_15_MHZ;
    REGISTER(XOSC_STARTUP) = STARTUP_1_MS;
    REGISTER(XOSC_CTRL) = XOSC_1_TO_15_MHZ | XOSC_ENABLE;
    while ((REGISTER(XOSC_STATUS) & XOSC_STABLE) == 0u) {
    }
    REGISTER(CLK_SYS_CTRL) = 0u; /* off the PLL while that is set */
    REGISTER(CLK_REF_CTRL) = CLK_REF_XOSC;
    while ((REGISTER(CLK_REF_SELECTED) & (1u << CLK_REF_XOSC)) == 0u) {
    }
    clocks_unreset(RESET_PLL_SYS | RESET_PLL_USB);
    start_pll(PLL_SYS, 125u, 6u, 2u);
    start_pll(PLL_USB, 100u, 5u, 5u);
    REGISTER(CLK_SYS_CTRL) = CLK_SYS_AUX;
    while ((REGISTER(CLK_SYS_SELECTED) & (1u << CLK_SYS_AUX)) == 0u) {
    }
    REGISTER(CLK_USB_CTRL) = CLK_ENABLE;
    REGISTER(CLK_ADC_CTRL) = CLK_ENABLE;
    clocks_unreset(RESET_TIMER);
    REGISTER(WATCHDOG_TICK) = WATCHDOG_TICK_ENABLE | CRYSTAL_MHZ;
}
