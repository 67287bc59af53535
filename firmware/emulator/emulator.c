/* tomoskin-emulator [-s SKIN_MEMORY] [-e EEPROM] [-l LINK] [-w WATCH] [-f] [-r] [-d] ELF:
   the firmware on a simulated ATmega2560. Its switches and converter inputs are as in avr/pins.h;
   what they must never do is said on stderr. -e: a file that its EEPROM begins with. -f: while it scans, as fast as it goes and not in real
   time. -r: opening the port resets the board, and for a second its bootloader swallows what is
   said to it; as the stock one it clears MCUSR, hands a watchdog's reset over at once, and before all
   others sets up the serial line. -d: end when stdin does. */
#include "skin.h"
#include "watch.h"

#include <avr_adc.h>
#include <avr_eeprom.h>
#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
#include <sim_io.h>

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define CLOCK 16000000ull
#define SLICE 16000ull /* cycles between two looks at line and clock: 1 ms */
#define LEAST_DEAD_CYCLES 16ull
#define OFF 0xFFu
#define SCANS_CYCLES (CLOCK / 5u) /* after the last drive it no longer scans */
#define BREAK_CYCLES 1600u        /* between two drives; without any a host waits for an answer */
#define BOOTLOADER_CYCLES CLOCK /* a second, as on a Mega 2560 */
#define OVERRUN_CYCLES 480ull   /* three bytes at 1 MBd: two that the processor holds, and the one behind them */

/* Places in data space. */
enum { PORT_A = 0x22, DDR_C = 0x27, PORT_C = 0x28, MCU_SR = 0x54, SP_L = 0x5D, SP_H = 0x5E, ADC_L = 0x78, ADC_H = 0x79, ADC_SRB = 0x7B, ADC_MUX = 0x7C, UCSR_0A = 0xC0, UCSR_0B = 0xC1, UDR_0 = 0xC6 };
enum { SOURCE_0 = 1, SOURCE_8 = 2, SINK_0 = 4, SINK_8 = 8, LATCH = 16, MUX5 = 8, WDRF = 8, RXEN_TXEN = 0x18, RXC = 0x80, DOR = 8 };

static avr_t *avr;
static const struct skin_memory *skin;
static int line = -1;
static bool fast;
static bool dependent;
static bool resets_on_open;
static struct watch *watch;
static avr_irq_t *line_input;
static bool may_feed = true;
static uint8_t address;       /* that the demultiplexers hold */
static unsigned source = OFF; /* connected */
static unsigned sink = OFF;
static avr_cycle_count_t opened;
static avr_cycle_count_t passed; /* until when the electrodes have charged */
static uint16_t code; /* of the conversion */
static avr_cycle_count_t heard; /* when interrupts were on last, or the line was looked at; 0: not yet */
static uint8_t out[4096];
static size_t n_out;

static _Noreturn void give_up(const char *what) {
    (void)fprintf(stderr, "tomoskin-emulator: %s\n", what);
    exit(1);
}

static void complain(const char *what) {
    (void)fprintf(stderr, "cycle %llu: %s\n", (unsigned long long)avr->cycle, what);
}

static unsigned chosen(uint8_t low, uint8_t high, unsigned number, const char *both) {
    uint8_t control = avr->data[PORT_C] & avr->data[DDR_C];
    if ((control & low) != 0 && (control & high) != 0) {
        complain(both);
    }
    return (control & low) != 0 ? number : (control & high) != 0 ? number + 8u : OFF;
}

/* What has flowed until now has charged the electrodes. */
static void pass(void) {
    skin_pass(skin, source, sink, (double)(avr->cycle - passed) / CLOCK);
    passed = avr->cycle;
}

/* What is connected from now on. */
static void connect(unsigned new_source, unsigned new_sink) {
    pass();
    bool was_on = source != OFF || sink != OFF;
    bool is_on = new_source != OFF || new_sink != OFF;
    if (watch != NULL && source < WATCH_CHANNELS && sink < WATCH_CHANNELS) {
        int64_t spent = (int64_t)(avr->cycle - watch->since);
        watch->net[source < sink ? source : sink] += source > sink ? spent : -spent;
    }
    source = new_source;
    sink = new_sink;
    if (was_on && !is_on) {
        opened = avr->cycle;
    }
    if (watch != NULL && is_on && !was_on && opened != 0 && avr->cycle - opened < watch->shortest_off) {
        watch->shortest_off = avr->cycle - opened;
    }
    if (watch == NULL || was_on == is_on) {
        return;
    }
    if (was_on && avr->cycle - watch->since > watch->longest_on) {
        watch->longest_on = avr->cycle - watch->since;
    }
    watch->since = avr->cycle;
    watch->connected = is_on;
}

static void on_control(struct avr_irq_t *irq, uint32_t value, void *unused) {
    (void)irq;
    (void)unused;
    if ((value & LATCH) == 0) {
        address = avr->data[PORT_A];
    }
    unsigned was_on = source != OFF || sink != OFF;
    avr->data[PORT_C] = (uint8_t)value;
    unsigned new_source = chosen(SOURCE_0, SOURCE_8, address & 7u, "two sources");
    unsigned new_sink = chosen(SINK_0, SINK_8, address >> 3 & 7u, "two sinks");
    if (new_source == source && new_sink == sink) {
        return;
    }
    unsigned is_on = new_source != OFF || new_sink != OFF;
    if (is_on && was_on) {
        complain("make before break");
    }
    if (is_on && !was_on && opened != 0 && avr->cycle - opened < LEAST_DEAD_CYCLES) {
        complain("dead time too short");
    }
    if (is_on && new_source == new_sink) {
        complain("source = sink");
    }
    if ((new_source == OFF) != (new_sink == OFF)) {
        complain("half a drive");
    }
    connect(new_source, new_sink);
}

/* A pin that becomes an output connects what has been written to it before. */
static void on_direction(struct avr_irq_t *irq, uint32_t value, void *unused) {
    avr->data[DDR_C] = (uint8_t)value;
    on_control(irq, avr->data[PORT_C], unused);
}

static void on_conversion(struct avr_irq_t *irq, uint32_t value, void *unused) {
    (void)irq;
    (void)value;
    (void)unused;
    unsigned channel = (avr->data[ADC_MUX] & 7u) | ((avr->data[ADC_SRB] & MUX5) != 0 ? 8u : 0u);
    pass();
    code = skin_code(skin, source, sink, channel);
}

static uint8_t read_code(struct avr_t *machine, avr_io_addr_t at, void *unused) {
    (void)unused;
    machine->data[at] = (uint8_t)(at == ADC_L ? code & 0xFF : code >> 8);
    return machine->data[at];
}

/* simavr's line holds as many bytes as it likes; the processor's holds two beside the one that comes.
   Where nobody has looked for longer than that, the rest is lost, and a flag says so until the next
   byte is read. */
static struct {
    avr_io_read_t read;
    void *param;
} status, data;
static bool overrun;

static uint8_t read_status(struct avr_t *machine, avr_io_addr_t at, void *unused) {
    (void)unused;
    uint8_t value = status.read(machine, at, status.param);
    bool deaf = heard != 0 && machine->cycle - heard > OVERRUN_CYCLES;
    overrun = overrun || (deaf && (value & RXC) != 0);
    return overrun ? value | DOR : value;
}

static uint8_t read_data(struct avr_t *machine, avr_io_addr_t at, void *unused) {
    (void)unused;
    uint8_t value = data.read(machine, at, data.param);
    if (overrun && (status.read(machine, UCSR_0A, status.param) & RXC) != 0) {
        value = data.read(machine, at, data.param); /* the byte between has gone */
    }
    overrun = false;
    return value;
}

static void on_output(struct avr_irq_t *irq, uint32_t value, void *unused) {
    (void)irq;
    (void)unused;
    if (n_out < sizeof out) {
        out[n_out++] = (uint8_t)value;
    }
    if (watch != NULL && value == 0) {
        watch->said = avr->cycle - opened;
    }
}

static void on_xon(struct avr_irq_t *irq, uint32_t value, void *flag) {
    (void)irq;
    (void)value;
    may_feed = flag != NULL;
}

/* Nobody who reads: what does not fit is lost, as on a wire. At full speed the board waits. */
static void flush_line(void) {
    for (size_t done = 0; done < n_out;) {
        ssize_t sent = write(line, out + done, n_out - done);
        if (sent > 0) {
            done += (size_t)sent;
        } else if (!fast || errno != EAGAIN) {
            break;
        } else {
            struct pollfd can = {line, POLLOUT, 0};
            (void)poll(&can, 1, 1000);
        }
    }
    n_out = 0;
}

static void feed_line(void) {
    static uint8_t in[32];
    static ssize_t n_in;
    static ssize_t next;
    if (next == n_in) {
        n_in = read(line, in, sizeof in);
        next = 0;
        n_in = n_in > 0 ? n_in : 0;
    }
    while (next < n_in && may_feed) {
        avr_raise_irq(line_input, in[next++]);
    }
}

/* Whoever started this has gone, however it ended. */
static bool abandoned(void) {
    struct pollfd owner = {STDIN_FILENO, 0, 0};
    return dependent && poll(&owner, 1, 0) == 1 && (owner.revents & (POLLHUP | POLLERR)) != 0;
}

static void no_sleep(struct avr_t *machine, avr_cycle_count_t cycles) {
    (void)machine;
    (void)cycles;
}

static uint64_t now_ns(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000ull + (uint64_t)now.tv_nsec;
}

/* Wait until the wall clock is as far as the simulated one; time once lost is not caught up. */
static void keep_pace(void) {
    static uint64_t start;
    static avr_cycle_count_t from;
    if (fast && avr->cycle - opened < SCANS_CYCLES) {
        start = 0;
        return;
    }
    uint64_t now = now_ns();
    uint64_t due = start + (avr->cycle - from) * 125u / 2u;
    if (start == 0 || now > due + 50000000u) {
        start = now;
        from = avr->cycle;
    } else if (due > now) {
        struct timespec nap = {0, (long)(due - now)};
        (void)nanosleep(&nap, NULL);
    }
}

static void open_line(const char *link_path) {
    int terminal;
    char name[128];
    struct termios raw;
    if (openpty(&line, &terminal, name, NULL, NULL) != 0) {
        give_up("no pty");
    }
    (void)tcgetattr(terminal, &raw);
    cfmakeraw(&raw);
    (void)tcsetattr(terminal, TCSANOW, &raw);
    (void)fcntl(line, F_SETFL, O_NONBLOCK);
    if (resets_on_open) {
        (void)close(terminal); /* so that an opening shows */
    }
    if (link_path != NULL) {
        (void)unlink(link_path);
        if (symlink(name, link_path) != 0) {
            give_up("the link cannot be made");
        }
    }
    (void)printf("%s\n", link_path != NULL ? link_path : name);
    (void)fflush(stdout);
}

static void fill_eeprom(const char *path) {
    uint8_t bytes[4096];
    FILE *file = fopen(path, "rb");
    size_t size = file != NULL ? fread(bytes, 1, sizeof bytes, file) : 0;
    if (size == 0) {
        give_up("the EEPROM's file cannot be read");
    }
    (void)fclose(file);
    avr_eeprom_desc_t eeprom = {.ee = bytes, .offset = 0, .size = (uint32_t)size};
    (void)avr_ioctl(avr, AVR_IOCTL_EEPROM_SET, &eeprom);
}

static void say_errors(struct avr_t *machine, const int level, const char *format, va_list values) {
    (void)machine;
    if (level == LOG_ERROR) {
        (void)vfprintf(stderr, format, values);
    }
}

static void (*core_reset)(struct avr_t *machine);
static bool has_reset = true;

/* Pins float in reset, and pull-downs keep the enables low. */
static void on_reset(struct avr_t *machine) {
    core_reset(machine);
    connect(OFF, OFF);
    address = 0;
    n_out = 0;
    may_feed = true;
    has_reset = true;
    heard = 0;
    if (watch != NULL) {
        watch->resets++;
    }
}

/* The port has been opened: DTR pulls the reset line, and the bootloader runs first. */
static avr_cycle_count_t booted;
static void mind_opening(void) {
    static bool was_open;
    struct pollfd port = {line, 0, 0};
    (void)poll(&port, 1, 0);
    bool is_open = (port.revents & POLLHUP) == 0;
    if (is_open && !was_open) {
        avr_reset(avr);
        avr_regbit_set(avr, avr->reset_flags.extrf);
        booted = avr->cycle + BOOTLOADER_CYCLES;
    }
    was_open = is_open;
}

/* What the bootloader leaves behind. */
static void hand_over(void) {
    has_reset = false;
    avr->data[UCSR_0B] = (avr->data[MCU_SR] & WDRF) != 0 ? 0 : RXEN_TXEN; /* simavr has a transmitter on */
    avr->data[MCU_SR] = 0;
}

/* The bootloader's second: nothing but time goes by. */
static void boot(void) {
    uint8_t swallowed[64];
    while (read(line, swallowed, sizeof swallowed) > 0) {
    }
    avr->cycle += SLICE;
}

static void build_board(const char *path) {
    elf_firmware_t firmware;
    avr_global_logger_set(say_errors);
    (void)memset(&firmware, 0, sizeof firmware);
    if (elf_read_firmware(path, &firmware) != 0) {
        give_up("the ELF cannot be read");
    }
    avr = avr_make_mcu_by_name("atmega2560");
    if (avr == NULL || avr_init(avr) != 0) {
        give_up("simavr has no atmega2560");
    }
    firmware.frequency = CLOCK;
    firmware.eesize = 0; /* it has never been written, as that of a new board */
    avr_load_firmware(avr, &firmware);
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->sleep = no_sleep;
    core_reset = avr->reset;
    avr->reset = on_reset;
    avr->log = LOG_ERROR;
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), IOPORT_IRQ_REG_PORT),
                            on_control, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), IOPORT_IRQ_DIRECTION_ALL),
                            on_direction, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER),
                            on_conversion, NULL);
    avr->io[ADC_L - 32].r.c = read_code;
    avr->io[ADC_H - 32].r.c = read_code;
    status.read = avr->io[UCSR_0A - 32].r.c;
    status.param = avr->io[UCSR_0A - 32].r.param;
    data.read = avr->io[UDR_0 - 32].r.c;
    data.param = avr->io[UDR_0 - 32].r.param;
    avr->io[UCSR_0A - 32].r.c = read_status;
    avr->io[UDR_0 - 32].r.c = read_data;
    uint32_t flags = 0;
    (void)avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    line_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
                            on_output, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), on_xon,
                            &may_feed);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), on_xon,
                            NULL);
}

/* Whether the instruction is LDS from UCSR0A. */
static bool looks_at_line(avr_flashaddr_t at) {
    const uint8_t *word = avr->flash + at;
    return (word[1] & 0xFEu) == 0x90u && (word[0] & 0x0Fu) == 0u && word[2] == 0xC0u && word[3] == 0u;
}

/* One instruction, and the time until the next one may run. */
static void run(void) {
    avr_flashaddr_t at = avr->pc;
    avr_cycle_count_t before = avr->cycle;
    bool listening = avr->sreg[S_I] != 0;
    int state = avr_run(avr);
    if (state == cpu_Done || state == cpu_Crashed) {
        give_up("the firmware has crashed");
    }
    if (watch == NULL) {
        if (listening || looks_at_line(at)) {
            heard = avr->cycle;
        }
        return;
    }
    uint16_t stack = (uint16_t)(avr->data[SP_L] | avr->data[SP_H] << 8);
    if (state == cpu_Running) {
        watch->spent[at / 2u % WATCH_WORDS] += avr->cycle - before;
    }
    if (stack >= 0x200u && stack < watch->lowest_stack) { /* not yet set up: 0 */
        watch->lowest_stack = stack;
    }
    bool scans = source != OFF || heard < opened + BREAK_CYCLES;
    if (opened != 0 && heard != 0 && scans && before - heard > watch->longest_deaf) {
        watch->longest_deaf = before - heard;
    }
    if (listening || looks_at_line(at)) {
        heard = avr->cycle; /* it may have slept until now */
    }
}

int main(int count, char **arguments) {
    const char *link = NULL;
    const char *eeprom = NULL;
    skin = skin_star();
    for (int option; (option = getopt(count, arguments, "s:e:l:w:frd")) != -1;) {
        if (option == 's') {
            skin = skin_open(optarg);
        } else if (option == 'e') {
            eeprom = optarg;
        } else if (option == 'l') {
            link = optarg;
        } else if (option == 'w') {
            watch = watch_make(optarg);
        } else if (option == 'r') {
            resets_on_open = true;
        } else if (option == 'f') {
            fast = true;
        } else if (option == 'd') {
            dependent = true;
        } else {
            return 2;
        }
    }
    if (optind + 1 != count) {
        give_up("expected one ELF");
    }
    build_board(arguments[optind]);
    if (eeprom != NULL) {
        fill_eeprom(eeprom);
    }
    open_line(link);
    avr_cycle_count_t next = 0;
    for (;;) {
        if (avr->cycle < booted) {
            boot();
        } else {
            if (has_reset && resets_on_open) {
                hand_over();
            }
            run();
        }
        if (avr->cycle >= next) {
            next = avr->cycle + SLICE;
            flush_line();
            feed_line();
            if (resets_on_open) {
                mind_opening();
            }
            if (watch != NULL) {
                watch->cycle = avr->cycle;
            }
            if (abandoned()) {
                return 0;
            }
            keep_pace();
        }
    }
}
