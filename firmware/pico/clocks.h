/* The clocks: crystal of 12 MHz, processor at 125 MHz, USB and converter at 48 MHz. */
#ifndef TOMOSKIN_CLOCKS_H
#define TOMOSKIN_CLOCKS_H

#include <stdint.h>

/* Take parts of the chip out of reset, and wait until they are. */
void clocks_unreset(uint32_t parts);

void clocks_start(void);

#endif
