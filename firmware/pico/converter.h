/* The converter: that of the front end where there is one, else the processor's own; 12 bits, 2 us a conversion, behind the multiplexer of the electrodes. */
#ifndef TOMOSKIN_CONVERTER_H
#define TOMOSKIN_CONVERTER_H

#include <stdbool.h>

/* Whether an ADS7042 answers: then it is read, else the processor's own. */
bool converter_start(void);

#endif
