/* A QEMU plugin: what stands around the CPU of QEMU's board lm3s6965evb, as firmware/ports/lm3s6965
 * wants it, and a clock that stands still whenever the simulation around it wants to (lockstep.h).
 *
 * With -icount, QEMU's virtual clock is the number of instructions, and it is stopped by a timer in
 * that time: so what happens when does not depend on the machine it runs on. What QEMU does not
 * model is made up for here:
 * - a UART's BUSY flag, and the time that it takes to send
 * - flash that can be written, and takes its time; not that the CPU waits for it
 * - an ADC that reads what it is told, and takes its time
 * - why it was reset, and a watchdog that ends this process: the next one has all memory fresh but
 *   the word of RAM that the image wants to outlive that
 */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim_qemu/lockstep.h"
#include "sim_qemu/qemu_api.h"
#include "sim_qemu/watch.h"

__attribute__((visibility("default"))) const int qemu_plugin_version = QEMU_PLUGIN_VERSION;
__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id,
                                                               const qemu_info_t* info, int argc,
                                                               char** argv);

/* QEMU's names for them, in the order in which the board makes them. */
#define GPIO_A "/machine/unattached/device[8]"
#define GPIO_B "/machine/unattached/device[9]"
#define GPIO_C "/machine/unattached/device[10]"
#define GPIO_D "/machine/unattached/device[11]"
#define GPIO_E "/machine/unattached/device[12]"
#define GPIO_F "/machine/unattached/device[13]"
#define TIMER_1 "/machine/unattached/device[4]" /* begins ticks */
#define TIMER_2 "/machine/unattached/device[5]" /* starts and paces what is sent */
#define UART_0 "/machine/unattached/device[16]"

#define TIMER_CTL 0xCu
#define TIMER_IMR 0x18u
#define PAGE 0x1000u /* of registers */
#define FLASH_CONTROL 0x400FD000u
#define FLASH_PAGE 1024u
#define FLASH_KEY 0xA442u
#define ADC_AT 0x40038000u
#define WATCHDOG_AT 0x40000000u
#define RESET_CAUSE_AT 0x400FE05Cu
#define UART_0_AT 0x4000C000u
#define RAM 0x20000000u
#define CYCLE_NS 20
#define ADC_SAMPLE_NS INT64_C(1000)

#define EVENTS 1024
#define BYTES 4096 /* on their way; a power of two */

static struct {
  int fd;
  QEMUTimer timer;
  lockstep_message events[EVENTS];
  size_t event_count;
  int64_t until_ns;
  bool until_sent;
} lockstep;

static struct {
  MemoryRegion region;
  MemoryRegion* real;
  MemoryRegion* timer;
  Chardev* line;
  lockstep_message bytes[BYTES];
  size_t bytes_in;
  size_t bytes_out;
  uint32_t divisor; /* in 1/64 */
  int64_t busy_until_ns;
} uart;

/* Flash that the image writes to. Writing only makes zeros of ones. */
#define WRITTEN 0x27800u
#define WRITTEN_SIZE (98 * FLASH_PAGE)
static struct {
  MemoryRegion region;
  uint32_t address;
  uint32_t data;
  uint32_t words[WRITTEN_SIZE / 4];
  uint32_t command;
  int64_t busy_until_ns;
  bool worn;
} flash;

static struct {
  MemoryRegion region;
  uint32_t result;
  uint32_t averaging; /* of 2 to the power of it samples */
  int64_t ready_ns;
} adc;

static struct {
  MemoryRegion region;
  uint32_t flags;
} reset_cause;

static struct {
  MemoryRegion region;
  QEMUTimer timer;
  uint32_t load;
  uint32_t control;
  bool interrupt;
} watchdog;

#define SYSTEM_INPUTS 4
static qemu_irq system_input[SYSTEM_INPUTS];
static uint32_t system_levels;

static struct {
  qemu_irq data; /* to the CPU */
  uint32_t inputs;
  uint32_t loaded;
  bool load;
  uint32_t out;
  bool out_data;
  bool stuck;
} shifter;

static void give_up(void) {
  _exit(1);
}

/* The other side is gone: nobody is there to be told. */
static void put_all(const void* bytes, size_t size) {
  const char* at = bytes;
  while (size > 0) {
    const ssize_t put = write(lockstep.fd, at, size);
    if (put <= 0) give_up();
    at += put;
    size -= (size_t)put;
  }
}

static void get_all(void* bytes, size_t size) {
  char* at = bytes;
  while (size > 0) {
    const ssize_t got = read(lockstep.fd, at, size);
    if (got <= 0) give_up();
    at += got;
    size -= (size_t)got;
  }
}

static void flush(void) {
  put_all(lockstep.events, lockstep.event_count * sizeof lockstep.events[0]);
  lockstep.event_count = 0;
}

static void tell(uint32_t kind, uint32_t value, uint32_t address) {
  if (lockstep.event_count == EVENTS) flush();
  lockstep.events[lockstep.event_count++] =
      (lockstep_message){.time_ns = qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL),
                         .kind = kind,
                         .value = value,
                         .address = address};
}

static bool watches;

/* Within a block of translated code QEMU's clock cannot be read: the event has no time. */
static void on_violation(const watch_violation* violation) {
  flush();
  lockstep.events[lockstep.event_count++] = (lockstep_message){.kind = LOCKSTEP_VIOLATION,
                                                               .value = violation->kind,
                                                               .address = violation->address,
                                                               .pc = violation->pc,
                                                               .caller = violation->caller};
  flush();
  _exit(1);
}

static void store(uint32_t address, uint32_t word) {
  if (address < WRITTEN || address >= WRITTEN + WRITTEN_SIZE) {
    if (!watches) give_up();
    on_violation(&(watch_violation){.kind = LOCKSTEP_STORES_FOREIGN, .address = address});
  }
  flash.words[(address - WRITTEN) / 4] = word;
  address_space_write_rom(&address_space_memory, address, MEMTXATTRS_UNSPECIFIED, &word,
                          sizeof word);
}

static uint32_t register_of(MemoryRegion* region, hwaddr address) {
  uint64_t data = 0;
  memory_region_dispatch_read(region, address, &data, MO_32, MEMTXATTRS_UNSPECIFIED);
  return (uint32_t)data;
}

static const lockstep_message* next_byte(void) {
  return uart.bytes_out == uart.bytes_in ? NULL : &uart.bytes[uart.bytes_out % BYTES];
}

static void hear(void) {
  const uint8_t byte = (uint8_t)next_byte()->value;
  ++uart.bytes_out;
  if (qemu_chr_be_can_write(uart.line) > 0) {
    qemu_chr_be_write(uart.line, &byte, 1);
  } else {
    tell(LOCKSTEP_OVERRUN, byte, 0);
  }
}

static void set_timer(void) {
  const lockstep_message* byte = next_byte();
  const bool byte_first = byte != NULL && byte->time_ns < lockstep.until_ns;
  timer_mod(&lockstep.timer, byte_first ? byte->time_ns : lockstep.until_ns);
}

static MemoryRegion* tick_timer;

static void cover(MemoryRegion* region, hwaddr at, uint64_t size, const MemoryRegionOps* ops) {
  memory_region_init_io(region, NULL, ops, NULL, "bushd", size);
  memory_region_add_subregion_overlap(get_system_memory(), at, region, 1);
}

/* A word of RAM with a bit that is always 1. */
static uint32_t stuck;

static uint64_t stuck_read(void* opaque, hwaddr address, unsigned size) {
  (void)opaque;
  (void)address;
  (void)size;
  return stuck | 1u;
}

static void stuck_write(void* opaque, hwaddr address, uint64_t data, unsigned size) {
  (void)opaque;
  (void)address;
  (void)size;
  stuck = (uint32_t)data;
}

static void stick(uint32_t address) {
  static MemoryRegion region;
  static const MemoryRegionOps kStuck = {
      .read = stuck_read, .write = stuck_write, .endianness = DEVICE_LITTLE_ENDIAN};
  cover(&region, address, 4, &kStuck);
}

static void show_system_inputs(void) {
  for (int i = 0; i < SYSTEM_INPUTS; ++i) qemu_set_irq(system_input[i], system_levels >> i & 1u);
}

/* Until it may run. */
static void obey(void) {
  for (;;) {
    lockstep_message command;
    get_all(&command, sizeof command);
    switch (command.kind) {
      case LOCKSTEP_RUN:
        lockstep.until_ns = command.time_ns;
        lockstep.until_sent = command.value != 0;
        return;
      case LOCKSTEP_BYTE:
        if (uart.bytes_in - uart.bytes_out == BYTES) give_up();
        uart.bytes[uart.bytes_in++ % BYTES] = command;
        break;
      case LOCKSTEP_INPUTS:
        shifter.inputs = command.value;
        system_levels = command.address;
        show_system_inputs();
        break;
      case LOCKSTEP_RESET_CAUSE:
        reset_cause.flags = command.value;
        break;
      case LOCKSTEP_STOP_TICKS:
        memory_region_dispatch_write(tick_timer, TIMER_IMR, 0, MO_32, MEMTXATTRS_UNSPECIFIED);
        break;
      case LOCKSTEP_KEPT_RAM:
        cpu_physical_memory_rw(RAM, &command.value, sizeof command.value, true);
        break;
      case LOCKSTEP_STICK:
        stick(command.address);
        break;
      case LOCKSTEP_WEAR_FLASH:
        flash.worn = true;
        break;
      case LOCKSTEP_STICK_INPUTS:
        shifter.stuck = true;
        break;
      case LOCKSTEP_FLASH:
        store(command.address, command.value);
        break;
      case LOCKSTEP_WATCH_CODE:
        watch_code(command.address, command.value, (uint8_t)command.time_ns);
        break;
      case LOCKSTEP_WATCH_OBJECT:
        watch_object(command.address, command.value, (uint64_t)command.time_ns);
        break;
      case LOCKSTEP_WATCH_FROM:
        watch_from(command.address);
        break;
      case LOCKSTEP_POKE:
        address_space_write_rom(&address_space_memory, command.address, MEMTXATTRS_UNSPECIFIED,
                                &command.value, 2);
        break;
      default:
        give_up();
    }
  }
}

static bool uart_busy(void) {
  return qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL) < uart.busy_until_ns;
}

static void on_time(void* opaque) {
  (void)opaque;
  /* The first time: QEMU resets its devices when they have been told. */
  show_system_inputs();
  const int64_t now_ns = qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL);
  while (next_byte() != NULL && next_byte()->time_ns <= now_ns) hear();
  if (now_ns >= lockstep.until_ns) {
    tell(LOCKSTEP_STOPPED, register_of(uart.timer, TIMER_CTL) & 1u, 0);
    flush();
    obey();
  }
  set_timer();
}

/* Pins. */
static void on_step(void* opaque, int motor, int level) {
  (void)opaque;
  tell(LOCKSTEP_STEP, (uint32_t)level, (uint32_t)motor);
}

static void on_enable(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  tell(LOCKSTEP_ENABLE, (uint32_t)level, 0);
}

static void on_common_dir(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  tell(LOCKSTEP_COMMON_DIR, (uint32_t)level, 0);
}

static void on_compare(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  tell(LOCKSTEP_COMPARE, (uint32_t)level, 0);
}

static void on_driver_enable(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  tell(LOCKSTEP_DRIVER_ENABLE, (uint32_t)level, uart_busy());
}

/* Of the 165 that comes last: motor 15. */
static void show_input(void) {
  qemu_set_irq(shifter.data, shifter.stuck || (shifter.loaded & 0x8000u) != 0);
}

static void on_shift_clock(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  if (!level) return;
  shifter.out = (shifter.out << 1 | shifter.out_data) & 0xFFFFu;
  if (!shifter.load) shifter.loaded = shifter.loaded << 1;
  show_input();
}

static void on_direction_data(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  shifter.out_data = level != 0;
}

static void on_direction_latch(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  if (level) tell(LOCKSTEP_DIRECTIONS, shifter.out, 0);
}

static void on_input_load(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  shifter.load = level == 0;
  if (shifter.load) shifter.loaded = shifter.inputs;
  show_input();
}

static Object* find(const char* path, const char* type) {
  Object* found = object_resolve_path(path, NULL);
  if (found == NULL || strcmp(object_get_typename(found), type) != 0) give_up();
  return found;
}

static DeviceState* gpio(const char* path) {
  return (DeviceState*)find(path, "pl061_luminary");
}

static void wire(DeviceState* port, int pin, void (*handler)(void*, int, int), int n) {
  qdev_connect_gpio_out(port, pin, qemu_allocate_irq(handler, NULL, n));
}

/* The UART is QEMU's; BUSY and how long a byte takes are added on the way. */
static uint64_t uart_read(void* opaque, hwaddr address, unsigned size) {
  (void)opaque;
  (void)size;
  uint64_t data = register_of(uart.real, address);
  if (address == 0x18u && uart_busy()) data |= 1u << 3;
  return data;
}

static void uart_write(void* opaque, hwaddr address, uint64_t data, unsigned size) {
  (void)opaque;
  (void)size;
  if (address == 0x24u) uart.divisor = (uint32_t)data << 6 | (uart.divisor & 0x3Fu);
  if (address == 0x28u) uart.divisor = (uart.divisor & ~0x3Fu) | (uint32_t)data;
  if (address == 0x00u) {
    const int64_t now_ns = qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL);
    const int64_t byte_ns = (int64_t)uart.divisor * 10 * CYCLE_NS / 4;
    uart.busy_until_ns = (uart.busy_until_ns > now_ns ? uart.busy_until_ns : now_ns) + byte_ns;
    tell(LOCKSTEP_SENT, (uint8_t)data, 0);
    if (lockstep.until_sent) {
      lockstep.until_ns = now_ns;
      timer_mod(&lockstep.timer, now_ns);
    }
  }
  memory_region_dispatch_write(uart.real, address, data, MO_32, MEMTXATTRS_UNSPECIFIED);
}

static uint64_t adc_read(void* opaque, hwaddr address, unsigned size) {
  (void)opaque;
  (void)size;
  if (address == 0xACu) return qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL) < adc.ready_ns ? 1u << 8 : 0;
  if (address != 0xA8u) return 0;
  adc.ready_ns = INT64_MAX;
  return adc.result;
}

static void adc_convert(void) {
  lockstep_message answer;
  tell(LOCKSTEP_CONVERTS, 0, 0);
  flush();
  get_all(&answer, sizeof answer);
  if (answer.kind != LOCKSTEP_CURRENT) give_up();
  adc.result = answer.value;
  adc.ready_ns = qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL) + (ADC_SAMPLE_NS << adc.averaging);
}

static void adc_write(void* opaque, hwaddr address, uint64_t data, unsigned size) {
  (void)opaque;
  (void)size;
  if (address == 0x30u) adc.averaging = (uint32_t)data & 7u;
  if (address == 0x28u && (data & 8u) != 0) adc_convert();
}

static uint64_t cause_read(void* opaque, hwaddr address, unsigned size) {
  (void)opaque;
  (void)address;
  (void)size;
  return reset_cause.flags;
}

static void cause_write(void* opaque, hwaddr address, uint64_t data, unsigned size) {
  (void)opaque;
  (void)address;
  (void)size;
  reset_cause.flags = (uint32_t)data;
}

static void watchdog_reload(void) {
  if ((watchdog.control & 1u) == 0) return;
  timer_mod(&watchdog.timer,
            qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL) + (int64_t)watchdog.load * CYCLE_NS);
}

static void on_watchdog(void* opaque) {
  (void)opaque;
  if (watchdog.interrupt && (watchdog.control & 2u) != 0) {
    uint32_t kept = 0;
    cpu_physical_memory_rw(RAM, &kept, sizeof kept, false);
    tell(LOCKSTEP_WATCHDOG, kept, 0);
    flush();
    _exit(0);
  }
  watchdog.interrupt = true;
  watchdog_reload();
}

static uint64_t watchdog_read(void* opaque, hwaddr address, unsigned size) {
  (void)opaque;
  (void)size;
  return address == 0x8u ? watchdog.control : 0;
}

static void watchdog_write(void* opaque, hwaddr address, uint64_t data, unsigned size) {
  (void)opaque;
  (void)size;
  if (address == 0x0u) watchdog.load = (uint32_t)data;
  if (address == 0x8u) watchdog.control |= (uint32_t)data;
  if (address == 0xCu) watchdog.interrupt = false;
  watchdog_reload();
}

static uint64_t flash_read(void* opaque, hwaddr address, unsigned size) {
  (void)opaque;
  (void)size;
  const bool busy = qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL) < flash.busy_until_ns;
  return address == 0x8u && busy ? flash.command : 0;
}

static void flash_takes(uint32_t command, int64_t ns) {
  flash.command = command;
  flash.busy_until_ns = qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL) + ns;
}

static void flash_store(uint32_t address, uint32_t word) {
  store(address, word);
  tell(LOCKSTEP_STORED, word, address);
}

static void flash_write(void* opaque, hwaddr address, uint64_t data, unsigned size) {
  (void)opaque;
  (void)size;
  if (address == 0x0u) flash.address = (uint32_t)data;
  if (address == 0x4u) flash.data = (uint32_t)data;
  if (address != 0x8u || data >> 16 != FLASH_KEY) return;
  if (data & 1u) {
    const uint32_t word = (flash.address - WRITTEN) / 4 % (WRITTEN_SIZE / 4);
    if (!flash.worn) flash_store(flash.address, flash.words[word] & flash.data);
    flash_takes(1u, 20000);
  }
  if (data & 2u) {
    const uint32_t page = flash.address & ~(FLASH_PAGE - 1u);
    for (uint32_t word = 0; word < FLASH_PAGE; word += 4) flash_store(page + word, UINT32_MAX);
    flash_takes(2u, 20000000);
  }
}

static void on_machine_done(Notifier* notifier, void* data) {
  (void)notifier;
  (void)data;
  static const MemoryRegionOps kUart = {
      .read = uart_read, .write = uart_write, .endianness = DEVICE_LITTLE_ENDIAN};
  static const MemoryRegionOps kFlash = {
      .read = flash_read, .write = flash_write, .endianness = DEVICE_LITTLE_ENDIAN};
  static const MemoryRegionOps kWatchdog = {
      .read = watchdog_read, .write = watchdog_write, .endianness = DEVICE_LITTLE_ENDIAN};
  static const MemoryRegionOps kCause = {
      .read = cause_read, .write = cause_write, .endianness = DEVICE_LITTLE_ENDIAN};
  static const MemoryRegionOps kAdc = {
      .read = adc_read, .write = adc_write, .endianness = DEVICE_LITTLE_ENDIAN};
  for (int i = 0; i < SYSTEM_INPUTS; ++i) system_input[i] = qdev_get_gpio_in(gpio(GPIO_A), 4 + i);
  for (int i = 0; i < 8; ++i) {
    wire(gpio(GPIO_B), i, on_step, i);
    wire(gpio(GPIO_D), i, on_step, 8 + i);
  }
  wire(gpio(GPIO_A), 2, on_enable, 0);
  wire(gpio(GPIO_F), 0, on_common_dir, 0);
  wire(gpio(GPIO_F), 1, on_compare, 0);
  wire(gpio(GPIO_A), 3, on_driver_enable, 0);
  wire(gpio(GPIO_E), 0, on_shift_clock, 0);
  wire(gpio(GPIO_E), 1, on_direction_data, 0);
  wire(gpio(GPIO_E), 2, on_direction_latch, 0);
  wire(gpio(GPIO_E), 3, on_input_load, 0);
  shifter.data = qdev_get_gpio_in(gpio(GPIO_C), 4);
  uart.line = qemu_chr_find("line");
  if (uart.line == NULL) give_up();
  uart.real = sysbus_mmio_get_region(find(UART_0, "pl011_luminary"), 0);
  uart.timer = sysbus_mmio_get_region(find(TIMER_2, "stellaris-gptm"), 0);
  cover(&uart.region, UART_0_AT, PAGE, &kUart);
  cover(&adc.region, ADC_AT, PAGE, &kAdc);
  cover(&flash.region, FLASH_CONTROL, PAGE, &kFlash);
  cover(&watchdog.region, WATCHDOG_AT, PAGE, &kWatchdog);
  cover(&reset_cause.region, RESET_CAUSE_AT, 4, &kCause);
  timer_init_full(&watchdog.timer, NULL, QEMU_CLOCK_VIRTUAL, 1, 0, on_watchdog, NULL);
  tick_timer = sysbus_mmio_get_region(find(TIMER_1, "stellaris-gptm"), 0);
  timer_init_full(&lockstep.timer, NULL, QEMU_CLOCK_VIRTUAL, 1, 0, on_time, NULL);
  memset(flash.words, 0xFF, sizeof flash.words);
  address_space_write_rom(&address_space_memory, WRITTEN, MEMTXATTRS_UNSPECIFIED, flash.words,
                          sizeof flash.words);
  obey();
  timer_mod(&lockstep.timer, 0);
}

int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t* info, int argc, char** argv) {
  (void)info;
  static Notifier machine_done = {.notify = on_machine_done};
  if (argc < 1 || strncmp(argv[0], "fd=", 3) != 0) return 1;
  lockstep.fd = atoi(argv[0] + 3);
  watches = argc > 1 && strcmp(argv[1], "watch=on") == 0;
  if (watches) watch_install(id, on_violation);
  qemu_add_machine_init_done_notifier(&machine_done);
  return 0;
}
