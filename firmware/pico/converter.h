/* The converter: 12 bits, 2 us a conversion, behind the multiplexer of the electrodes. */
#ifndef TOMOSKIN_CONVERTER_H
#define TOMOSKIN_CONVERTER_H

void converter_start(void);

#endif
