/* A QEMU plugin: what stands around the CPU of QEMU's board lm3s6965evb, as firmware/ports/lm3s6965
 * wants it, and a clock that stands still whenever the simulation around it wants to (lockstep.h).
 *
 * With -icount, QEMU's virtual clock is the number of instructions, and it is stopped by a timer in
 * that time: so what happens when does not depend on the machine it runs on. What QEMU does not
 * model is made up for in uart.c, pins.c and devices.c:
 * - a UART's BUSY flag, and the time that it takes to send
 * - flash that can be written, and takes its time; not that the CPU waits for it
 * - an ADC that reads what it is told, and takes its time
 * - why it was reset, and a watchdog that ends this process: the next one has all memory fresh but
 *   the word of RAM that the image wants to outlive that
 */
#include "sim/qemu/machine.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/qemu/watch.h"

/* Of the interface that QEMU declares: what is used of it is in all. 7.2 takes up to 1, 10.0 from 2
 * on. */
__attribute__((visibility("default"))) const int qemu_plugin_version = QEMU_PLUGIN_VERSION;
__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id,
                                                               const qemu_info_t* info, int argc,
                                                               char** argv);

#define TIMER_1 0x40031000u /* begins ticks */
#define TIMER_IMR 0x18u
#define EVENTS 1024

static struct {
  int fd;
  QEMUTimer timer;
  lockstep_message events[EVENTS];
  size_t event_count;
  int64_t until_ns;
  bool until_sent;
} lockstep;

static MemoryRegion* tick_timer;
static bool watches;

_Noreturn void give_up(void) {
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

void get_all(void* bytes, size_t size) {
  char* at = bytes;
  while (size > 0) {
    const ssize_t got = read(lockstep.fd, at, size);
    if (got <= 0) give_up();
    at += got;
    size -= (size_t)got;
  }
}

int64_t now(void) {
  return qemu_clock_get_ns(QEMU_CLOCK_VIRTUAL);
}

void flush(void) {
  put_all(lockstep.events, lockstep.event_count * sizeof lockstep.events[0]);
  lockstep.event_count = 0;
}

void tell(uint32_t kind, uint32_t value, uint32_t address) {
  if (lockstep.event_count == EVENTS) flush();
  lockstep.events[lockstep.event_count++] =
      (lockstep_message){.time_ns = now(), .kind = kind, .value = value, .address = address};
}

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

void store_violation(uint32_t address) {
  if (!watches) give_up();
  on_violation(&(watch_violation){.kind = LOCKSTEP_STORES_FOREIGN, .address = address});
}

uint32_t register_of(MemoryRegion* region, hwaddr address) {
  uint64_t data = 0;
  memory_region_dispatch_read(region, address, &data, MO_32, NO_ATTRIBUTES);
  return (uint32_t)data;
}

static uint64_t read_device(void* opaque, hwaddr address, unsigned size) {
  (void)size;
  return ((const device*)opaque)->read((uint32_t)address);
}

static void write_device(void* opaque, hwaddr address, uint64_t data, unsigned size) {
  (void)size;
  ((const device*)opaque)->write((uint32_t)address, (uint32_t)data);
}

void cover(device* d, hwaddr at, uint64_t size) {
  static const MemoryRegionOps kOps = {
      .read = read_device, .write = write_device, .endianness = DEVICE_LITTLE_ENDIAN};
  memory_region_init_io(&d->region, NULL, &kOps, d, "bushd", size);
  memory_region_add_subregion_overlap(get_system_memory(), at, &d->region, 1);
}

void begin_timer(QEMUTimer* timer, void (*callback)(void* opaque)) {
  timer_init_full(timer, NULL, QEMU_CLOCK_VIRTUAL, 1, 0, callback, NULL);
}

MemoryRegion* find(hwaddr at, const char* type) {
  MemoryRegion* const found = memory_region_find(get_system_memory(), at, 4).region;
  Object* const owner = found == NULL ? NULL : memory_region_owner(found);
  if (owner == NULL || strcmp(object_get_typename(owner), type) != 0) {
    fprintf(stderr, "QEMU's board has no %s at 0x%" PRIx64 "\n", type, at);
    give_up();
  }
  return found;
}

static void set_timer(void) {
  const lockstep_message* byte = uart_next_byte();
  const bool byte_first = byte != NULL && byte->time_ns < lockstep.until_ns;
  timer_mod(&lockstep.timer, byte_first ? byte->time_ns : lockstep.until_ns);
}

void byte_sent(uint8_t byte) {
  tell(LOCKSTEP_SENT, byte, 0);
  if (lockstep.until_sent) {
    lockstep.until_ns = now();
    timer_mod(&lockstep.timer, lockstep.until_ns);
  }
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
        uart_queue(&command);
        break;
      case LOCKSTEP_INPUTS:
        pins_set_inputs(command.value, command.address);
        break;
      case LOCKSTEP_RESET_CAUSE:
        reset_cause_set(command.value);
        break;
      case LOCKSTEP_STOP_TICKS:
        memory_region_dispatch_write(tick_timer, TIMER_IMR, 0, MO_32, NO_ATTRIBUTES);
        break;
      case LOCKSTEP_KEPT_RAM:
        cpu_physical_memory_rw(RAM, &command.value, sizeof command.value, true);
        break;
      case LOCKSTEP_STICK:
        ram_stick(command.address);
        break;
      case LOCKSTEP_WEAR_FLASH:
        flash_wear();
        break;
      case LOCKSTEP_STICK_INPUTS:
        pins_stick_inputs();
        break;
      case LOCKSTEP_FLASH:
        flash_set(command.address, command.value);
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
        address_space_write_rom(&address_space_memory, command.address, NO_ATTRIBUTES,
                                &command.value, 2);
        break;
      default:
        give_up();
    }
  }
}

static void on_time(void* opaque) {
  (void)opaque;
  /* Also the first time: QEMU resets its devices when they have been told. */
  pins_show_system_inputs();
  const int64_t now_ns = now();
  while (uart_next_byte() != NULL && uart_next_byte()->time_ns <= now_ns) uart_hear();
  if (now_ns >= lockstep.until_ns) {
    tell(LOCKSTEP_STOPPED, uart_timer_runs(), 0);
    flush();
    obey();
  }
  set_timer();
}

static void on_machine_done(Notifier* notifier, void* data) {
  (void)notifier;
  (void)data;
  pins_init();
  uart_init();
  devices_init();
  tick_timer = find(TIMER_1, "stellaris-gptm");
  begin_timer(&lockstep.timer, on_time);
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
