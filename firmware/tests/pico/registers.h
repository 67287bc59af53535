/* The RP2040's registers on another machine: see controller.cpp. */
#ifndef TOMOSKIN_TEST_REGISTERS_H
#define TOMOSKIN_TEST_REGISTERS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C"
#endif
uint8_t *simulated(uint32_t address, uint32_t size);

#define REGISTER(address) (*(volatile uint32_t *)simulated((address), 4u))
#define BYTES(address) ((volatile uint8_t *)simulated((address), 64u))

#endif
