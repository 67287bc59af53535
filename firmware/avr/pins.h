/* Pins of the ATmega2560 board. Made by hardware/pins.py from hardware/pins.toml, to which
   a test holds the board's schematics: change that table, not this file.

   Per channel a p-MOSFET to the current and an n-MOSFET to ground, chosen by CD74HC237 3-to-8
   demultiplexers, one for the sources and one for the sinks of each eight channels. A channel's
   potential comes to the converter input of its number: 0 to 7 on port F, 8 to 15 on port K.
   Enables have pull-downs: pins float in reset. */
#ifndef TOMOSKIN_PINS_H
#define TOMOSKIN_PINS_H

#include <avr/io.h>

/* Addresses, to all demultiplexers: source on bits 0-2, sink on bits 3-5 of port A. */
#define ADDRESS_PORT PORTA
#define ADDRESS_DDR DDRA
#define ADDRESS_MASK 0x3Fu
#define SINK_SHIFT 3u

/* Enables (E2, high connects), and the latch (LE, low takes the address): port C. */
#define CONTROL_PORT PORTC
#define CONTROL_DDR DDRC
#define SOURCE_ENABLE_0 _BV(PC0)
#define SOURCE_ENABLE_8 _BV(PC1)
#define SINK_ENABLE_0 _BV(PC2)
#define SINK_ENABLE_8 _BV(PC3)
#define LATCH _BV(PC4)
#define ENABLES (SOURCE_ENABLE_0 | SOURCE_ENABLE_8 | SINK_ENABLE_0 | SINK_ENABLE_8)

#endif
