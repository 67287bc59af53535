/* The second stage of the boot: what the boot ROM reads from the first 256 bytes of the flash and
   runs, if the checksum is right. It makes the flash readable, by the command that every flash
   knows, and goes on at the vector table behind it. Speed does not matter: the firmware copies
   itself into RAM. */
    .syntax unified
    .cpu cortex-m0plus
    .thumb

    .section .boot2, "ax"
    .global boot2
    .type boot2, %function
    .thumb_func
boot2:
    ldr r3, =0x18000000     /* SSI */
    movs r1, #0
    str r1, [r3, #0x08]     /* SSIENR: off while it is set */
    movs r1, #4
    str r1, [r3, #0x14]     /* BAUDR: a quarter of the processor's clock */
    ldr r1, =0x001F0300     /* CTRLR0: 32 bits, one line, EEPROM read */
    str r1, [r3, #0x00]
    movs r1, #0
    str r1, [r3, #0x04]     /* CTRLR1: one word at a time */
    ldr r1, =0x03000218     /* SPI_CTRLR0: command 03, 8 bits, then 24 of address */
    ldr r2, =0x180000F4
    str r1, [r2]
    movs r1, #1
    str r1, [r3, #0x10]     /* SER */
    str r1, [r3, #0x08]     /* SSIENR: on */
    ldr r0, =0x10000100     /* vectors of the flash image */
    ldr r1, =0xE000ED08     /* VTOR */
    str r0, [r1]
    ldr r1, [r0]
    msr msp, r1
    ldr r0, [r0, #4]
    bx r0
    .ltorg
    .org 252
    /* CRC-32 (0x04C11DB7, not reflected, from 0xFFFFFFFF) of the 252 bytes before: the packer of
       the UF2 says what it must be when this code changes. */
    .word 0xC22C96BF
