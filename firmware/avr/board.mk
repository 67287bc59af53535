# The board with an ATmega2560.
avr: $(BUILD)/tomoskin-$(CHANNELS).elf  ## the firmware for an ATmega2560; CHANNELS=8 CURRENT=50000

image: $(BUILD)/tomoskin-$(CHANNELS).hex  ## the same, as it is flashed

AVR_FLAGS := -mmcu=atmega2560 -DF_CPU=16000000ul -DBOARD_CURRENT_UA=$(CURRENT)ul \
	$(call limits,mega) -std=gnu11 -Os -flto -fwhole-program -fshort-enums -ffunction-sections \
	-Wall -Wextra -Wconversion -Wshadow -Werror

PYTHON ?= $(firstword $(wildcard ../.venv/bin/python) python3)
pins:  ## whether table, header and emulator agree on the pins
	@$(PYTHON) ../hardware/pins.py --check

$(BUILD)/tomoskin-$(CHANNELS).elf: $(wildcard src/*.c avr/*.c) $(HEADERS) avr/pins.h avr/board.mk $(BOARDS) Makefile | $(BUILD) $(if $(wildcard ../hardware/pins.py),pins)
	avr-gcc $(AVR_FLAGS) -Isrc -DCHANNELS=$(CHANNELS)u $(filter %.c,$^) -Wl,--gc-sections -o $@
	avr-size $@

$(BUILD)/tomoskin-$(CHANNELS).hex: $(BUILD)/tomoskin-$(CHANNELS).elf
	avr-objcopy -O ihex -R .eeprom $< $@
