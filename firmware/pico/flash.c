#include "flash.h"

#include "rp2040.h"

#include <string.h>

/* The last sector: its first word is the setting of the current limiter in uA, or all ones. */
#define SETTINGS (FLASH_BASE + FLASH_SIZE - FLASH_SECTOR)
#define READ_UNIQUE_ID 0x4Bu
#define ID_AT 5u /* after the command and four bytes that mean nothing */
#define ID_SIZE 8u
#define EIGHT_BITS (7u << 16)

static uint8_t unique_id[ID_SIZE];
static uint32_t current;

/* By hand, a byte at a time; all of it fits into the queue of the interface. */
static void ask_flash(void) {
    REGISTER(SSI_SSIENR) = 0u;
    REGISTER(SSI_CTRLR0) = EIGHT_BITS;
    REGISTER(SSI_CTRLR1) = 0u;
    REGISTER(SSI_BAUDR) = 8u;
    REGISTER(SSI_SER) = 1u;
    REGISTER(SSI_SSIENR) = 1u;
    SET_BITS(QSPI_SS_CTRL) = QSPI_SS_LOW;
    for (uint32_t sent = 0u; sent < ID_AT + ID_SIZE; sent++) {
        REGISTER(SSI_DR0) = sent == 0u ? READ_UNIQUE_ID : 0u;
    }
    while (REGISTER(SSI_RXFLR) < ID_AT + ID_SIZE) {
    }
    for (uint32_t came = 0u; came < ID_AT + ID_SIZE; came++) {
        uint8_t byte = (uint8_t)REGISTER(SSI_DR0);
        if (came >= ID_AT) {
            unique_id[came - ID_AT] = byte;
        }
    }
    CLEAR_BITS(QSPI_SS_CTRL) = QSPI_SS_OVERRIDE_MASK;
}

void flash_read_identity(void) {
    current = REGISTER(SETTINGS);
    if (current == UINT32_MAX) {
        current = BOARD_CURRENT_UA;
    }
    ask_flash();
}

void flash_unique_id(uint8_t *id) {
    (void)memcpy(id, unique_id, ID_SIZE);
}

uint32_t flash_current(void) {
    return current;
}
