# The board with a Raspberry Pi Pico.
pico: $(BUILD)/tomoskin-pico-$(CHANNELS).bin  ## the firmware for a Raspberry Pi Pico; CHANNELS=32

PICO_FLAGS := -mcpu=cortex-m0plus -mthumb -DBOARD_CURRENT_UA=$(CURRENT)ul $(call limits,pico) -std=gnu11 -O2 \
	-ffunction-sections -fdata-sections -ffreestanding -fno-tree-loop-distribute-patterns \
	-Wall -Wextra -Wconversion -Wshadow -Werror

$(BUILD)/tomoskin-pico-$(CHANNELS).elf: $(wildcard src/*.c pico/*.[chS] pico/*.ld) $(HEADERS) pico/board.mk $(BOARDS) Makefile | $(BUILD)
	arm-none-eabi-gcc $(PICO_FLAGS) -Isrc -DCHANNELS=$(CHANNELS)u $(filter %.c %.S,$^) -nostartfiles \
		-specs=nano.specs -Wl,--gc-sections -Wl,--no-warn-rwx-segments -T pico/link.ld -o $@
	arm-none-eabi-size $@

$(BUILD)/tomoskin-pico-$(CHANNELS).bin: $(BUILD)/tomoskin-pico-$(CHANNELS).elf
	arm-none-eabi-objcopy -O binary $< $@
