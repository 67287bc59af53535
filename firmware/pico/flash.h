/* What the flash says: its own number, and what the builder of the board knows. */
#ifndef TOMOSKIN_FLASH_H
#define TOMOSKIN_FLASH_H

#include <stdint.h>

/* Once, before anything else needs the flash: afterwards it can no longer be read. */
void flash_read_identity(void);

void flash_unique_id(uint8_t *id); /* eight bytes */
uint32_t flash_current(void);      /* uA */

#endif
