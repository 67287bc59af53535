/* Pins of the Pico's board; docs/firmware.md has them as a table.

   Addresses go to the switches' demultiplexers and to the multiplexer before the amplifier; the
   enables connect when high. Pads pull down from reset on, and so does a resistor on the board. */
#ifndef TOMOSKIN_PICO_PINS_H
#define TOMOSKIN_PICO_PINS_H

#define ADDRESS_MASK 0x1Fu /* five bits each: 32 electrodes */
#define SOURCE_SHIFT 2u
#define SINK_SHIFT 7u
#define READ_SHIFT 12u
#define SOURCE_ENABLE (1u << 17)
#define SINK_ENABLE (1u << 18)
#define LATCH (1u << 19) /* low takes the addresses of source and sink */
#define FIRST_OUTPUT 2u
#define LAST_OUTPUT 19u
#define OUTPUTS 0x000FFFFCu

/* Of the module itself: high keeps its regulator from bursts, since the converter divides by 3.3 V. */
#define REGULATOR_PIN 23u

/* SPI 0, to the front end's ADS7042. */
#define SPI_FROM_PIN 20u
#define SPI_SELECT_PIN 21u
#define SPI_CLOCK_PIN 22u

#define AMPLIFIER_PIN 26u
#define AMPLIFIER_INPUT 0u /* of the converter */

#endif
