/* Registers of the RP2040, as far as this firmware uses them; names, addresses and bits are the
   datasheet's. */
#ifndef TOMOSKIN_RP2040_H
#define TOMOSKIN_RP2040_H

#include <stdint.h>

#ifndef REGISTER /* tests on another machine have registers of their own */
#define REGISTER(address) (*(volatile uint32_t *)(address))
#define BYTES(address) ((volatile uint8_t *)(address))
#endif

/* Aliases of a register: write the bits to set, or to clear. */
#define SET_ALIAS 0x2000u
#define CLEAR_ALIAS 0x3000u
#define SET_BITS(address) REGISTER((address) + SET_ALIAS)
#define CLEAR_BITS(address) REGISTER((address) + CLEAR_ALIAS)

/* Flash: 2 MB on a Pico; its last sector holds what the builder of the board knows. */
#define FLASH_BASE 0x10000000u
#define FLASH_SIZE 0x200000u
#define FLASH_SECTOR 0x1000u

/* The serial interface to the flash. */
#define SSI_CTRLR0 0x18000000u
#define SSI_CTRLR1 0x18000004u
#define SSI_SSIENR 0x18000008u
#define SSI_SER 0x18000010u
#define SSI_BAUDR 0x18000014u
#define SSI_RXFLR 0x18000024u
#define SSI_DR0 0x18000060u
#define SSI_SPI_CTRLR0 0x180000F4u
#define QSPI_SS_CTRL 0x4001800Cu
#define QSPI_SS_OVERRIDE_MASK (3u << 8)
#define QSPI_SS_LOW (2u << 8)

/* Resets. */
#define RESETS_RESET 0x4000C000u
#define RESETS_DONE 0x4000C008u
#define RESET_ADC (1u << 0)
#define RESET_SPI0 (1u << 16)
#define RESET_DMA (1u << 2)
#define RESET_IO_BANK0 (1u << 5)
#define RESET_PADS_BANK0 (1u << 8)
#define RESET_PLL_SYS (1u << 12)
#define RESET_PLL_USB (1u << 13)
#define RESET_TIMER (1u << 21)
#define RESET_USBCTRL (1u << 24)
#define PSM_WDSEL 0x40010008u
#define PSM_ALL_BUT_OSCILLATORS 0x0001FFFCu
#define CHIP_RESET 0x40064008u
#define CHIP_HAD_POWER_ON (1u << 8)
#define CHIP_HAD_RUN_PIN (1u << 16)

/* Clocks. */
#define XOSC_CTRL 0x40024000u
#define XOSC_STATUS 0x40024004u
#define XOSC_STARTUP 0x4002400Cu
#define XOSC_1_TO_15_MHZ 0xAA0u
#define XOSC_ENABLE (0xFABu << 12)
#define XOSC_STABLE (1u << 31)
#define PLL_SYS 0x40028000u
#define PLL_USB 0x4002C000u
#define PLL_CS 0x0u
#define PLL_PWR 0x4u
#define PLL_FBDIV 0x8u
#define PLL_PRIM 0xCu
#define PLL_LOCKED (1u << 31)
#define PLL_POWER_OFF 0x21u /* PLL and its oscillator */
#define PLL_POSTDIV_OFF 0x8u
#define CLK_REF_CTRL 0x40008030u
#define CLK_REF_SELECTED 0x40008038u
#define CLK_REF_XOSC 2u
#define CLK_SYS_CTRL 0x4000803Cu
#define CLK_SYS_SELECTED 0x40008044u
#define CLK_SYS_AUX 1u
#define CLK_USB_CTRL 0x40008054u
#define CLK_ADC_CTRL 0x40008060u
#define CLK_PERI_CTRL 0x40008048u
#define CLK_ENABLE (1u << 11)

/* Pins. */
#define GPIO_CTRL(pin) (0x40014004u + 8u * (pin))
#define GPIO_SIO 5u
#define PAD(pin) (0x4001C004u + 4u * (pin))
#define PAD_OUTPUT 0x56u /* as after reset: 4 mA, pull-down */
#define GPIO_SPI 1u
#define PAD_PULLED_UP 0x5Au /* an input that reads ones where nothing drives it */
#define PAD_ANALOGUE 0x80u /* neither output, input nor pull */
#define SIO_OUT 0xD0000010u
#define SIO_OUT_SET 0xD0000014u
#define SIO_OUT_CLR 0xD0000018u
#define SIO_OUT_XOR 0xD000001Cu
#define SIO_OE_SET 0xD0000024u

/* Timer of 1 us, and the watchdog, whose tick it runs by. */
#define TIMER_ALARM(number) (0x40054010u + 4u * (number))
#define TIMER_ARMED 0x40054020u
#define TIMER_RAW_HIGH 0x40054024u
#define TIMER_RAW_LOW 0x40054028u
#define TIMER_INTR 0x40054034u
#define TIMER_INTE 0x40054038u
#define WATCHDOG_CTRL 0x40058000u
#define WATCHDOG_LOAD 0x40058004u
#define WATCHDOG_REASON 0x40058008u
#define WATCHDOG_TICK 0x4005802Cu
#define WATCHDOG_ENABLE (1u << 30)
#define WATCHDOG_TICK_ENABLE (1u << 9)

/* Converter. */
#define ADC_CS 0x4004C000u
#define ADC_FCS 0x4004C008u
#define ADC_FIFO 0x4004C00Cu
#define ADC_DIV 0x4004C010u
#define ADC_ENABLE (1u << 0)
#define ADC_START_MANY (1u << 3)
#define ADC_READY (1u << 8)
#define ADC_INPUT_SHIFT 12u
#define FCS_ENABLE (1u << 0)
#define FCS_DREQ (1u << 3)
#define FCS_EMPTY (1u << 8)
#define FCS_OVER (1u << 11)
#define FCS_FLAGS (3u << 10)
#define FCS_LEVEL(value) ((value) >> 16 & 15u)
#define FCS_THRESHOLD_1 (1u << 24)

/* DMA: channel 0. */
#define DMA_READ 0x50000000u
#define DMA_WRITE 0x50000004u
#define DMA_COUNT 0x50000008u
#define DMA_CTRL_TRIG 0x5000000Cu
#define DMA_CTRL 0x50000010u
#define DMA_INTE0 0x50000404u
#define DMA_INTS0 0x5000040Cu
#define DMA_ABORT 0x50000444u
#define DMA_ENABLE (1u << 0)
#define DMA_BUSY (1u << 24)
#define DMA_SIZE_16 (1u << 2)
#define DMA_INCREMENT_WRITE (1u << 5)
#define DMA_FROM_ADC (36u << 15)
#define DMA_FROM_SPI (17u << 15)

/* DMA: channel 1, which chains to itself: to no other. */
#define DMA1_READ 0x50000040u
#define DMA1_WRITE 0x50000044u
#define DMA1_COUNT 0x50000048u
#define DMA1_CTRL_TRIG 0x5000004Cu
#define DMA1_CTRL 0x50000050u
#define DMA1_ALONE (1u << 11)

/* SPI 0. */
#define SPI_CR0 0x4003C000u
#define SPI_CR1 0x4003C004u
#define SPI_DR 0x4003C008u
#define SPI_SR 0x4003C00Cu
#define SPI_PRESCALE 0x4003C010u
#define SPI_RAW 0x4003C018u
#define SPI_CLEAR 0x4003C020u
#define SPI_DMA 0x4003C024u
#define SPI_16_BITS 0xFu /* clock low at rest, bits taken when it rises; selects anew for each word */
#define SPI_ENABLE (1u << 1)
#define SPI_RECEIVED (1u << 2)
#define SPI_OVERRUN (1u << 0)
#define SPI_DMA_RECEIVE (1u << 0)

/* USB: registers, and the memory that it shares with the processor. */
#define USB_ADDR 0x50110000u
#define USB_MAIN_CTRL 0x50110040u
#define USB_SIE_CTRL 0x5011004Cu
#define USB_SIE_STATUS 0x50110050u
#define USB_BUFF_STATUS 0x50110058u
#define USB_EP_STALL_ARM 0x50110068u
#define USB_MUXING 0x50110074u
#define USB_PWR 0x50110078u
#define USB_INTE 0x50110090u
#define USB_INTS 0x50110098u
#define USB_ENABLE 1u
#define USB_TO_PHY 1u
#define USB_SOFTCON (1u << 3)
#define USB_VBUS_SEEN 0xCu
#define USB_EP0_INTERRUPT (1u << 29)
#define USB_PULL_UP (1u << 16)
#define USB_SUSPENDED (1u << 4)
#define USB_RESUMED (1u << 11)
#define USB_SETUP_CAME (1u << 17)
#define USB_BUS_RESET (1u << 19)
#define USB_ON_BUFFER (1u << 4)
#define USB_ON_BUS_RESET (1u << 12)
#define USB_ON_SUSPEND (1u << 14)
#define USB_ON_RESUME (1u << 15)
#define USB_ON_SETUP (1u << 16)
#define USB_MEMORY 0x50100000u
#define USB_MEMORY_SIZE 0x1000u
#define USB_EP_IN(endpoint) (USB_MEMORY + 8u * (endpoint))
#define USB_EP_OUT(endpoint) (USB_MEMORY + 8u * (endpoint) + 4u)
#define USB_BUFFER_IN(endpoint) (USB_MEMORY + 0x80u + 8u * (endpoint))
#define USB_BUFFER_OUT(endpoint) (USB_MEMORY + 0x84u + 8u * (endpoint))
#define USB_EP0_DATA (USB_MEMORY + 0x100u)
#define USB_EP_ENABLE (1u << 31)
#define USB_EP_INTERRUPT (1u << 29)
#define USB_EP_BULK (2u << 26)
#define USB_EP_PERIODIC (3u << 26)
#define USB_FULL (1u << 15)
#define USB_DATA1 (1u << 13)
#define USB_STALL (1u << 11)
#define USB_AVAILABLE (1u << 10)
#define USB_LENGTH_MASK 0x3FFu

/* The processor's own. */
#define SYSTICK_CTRL 0xE000E010u
#define SYSTICK_RELOAD 0xE000E014u
#define SYSTICK_NOW 0xE000E018u
#define NVIC_ENABLE 0xE000E100u
#define NVIC_PENDING 0xE000E200u
#define NVIC_CLEAR 0xE000E280u
#define NVIC_PRIORITY(group) (0xE000E400u + 4u * (group))
#define VECTOR_TABLE 0xE000ED08u
#define IRQ_TIMER_0 0u
#define IRQ_TIMER_1 1u
#define IRQ_USB 5u
#define IRQ_DMA_0 11u
#define IRQ_SEND 26u /* of no part of the chip */

#endif
