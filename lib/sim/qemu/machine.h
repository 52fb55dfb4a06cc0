/* The parts of the machine around QEMU's CPU: machine.c runs it in lockstep with the simulation,
 * uart.c, pins.c and devices.c are what stands around the CPU. */
#ifndef BUSHD_LIB_SIM_QEMU_MACHINE_H
#define BUSHD_LIB_SIM_QEMU_MACHINE_H

#include "sim/qemu/lockstep.h"
#include "sim/qemu/qemu_api.h"

#define CYCLE_NS 20
#define RAM 0x20000000u

/* machine.c: the other side. */
_Noreturn void give_up(void);
/* An event, now. */
void tell(uint32_t kind, uint32_t value, uint32_t address);
void flush(void);
void get_all(void* bytes, size_t size);
/* The image has given the UART a byte. */
void byte_sent(uint8_t byte);
/* The image stores where it must not. Returns if nobody watches. */
void store_violation(uint32_t address);

/* Since its first instruction. */
int64_t now(void);

/* machine.c: QEMU's devices. `size` bytes at `at` are this device's from now on. */
typedef struct device {
  uint32_t (*read)(uint32_t address);
  void (*write)(uint32_t address, uint32_t value);
  MemoryRegion region;
} device;
void cover(device* d, hwaddr at, uint64_t size);
/* Its time is the machine's. */
void begin_timer(QEMUTimer* timer, void (*callback)(void* opaque));
/* The registers of QEMU's device of that type at `at`; before anything covers them. */
MemoryRegion* find(hwaddr at, const char* type);
uint32_t register_of(MemoryRegion* region, hwaddr address);

/* uart.c */
void uart_init(void);
bool uart_busy(void);
/* Of its transmitter. */
bool uart_timer_runs(void);
/* A byte on its way to it, in the order of their times; NULL: none. */
void uart_queue(const lockstep_message* byte);
const lockstep_message* uart_next_byte(void);
void uart_hear(void);

/* pins.c */
void pins_init(void);
void pins_set_inputs(uint32_t motors, uint32_t system);
void pins_stick_inputs(void);
/* QEMU resets its devices when they have been told. */
void pins_show_system_inputs(void);

/* devices.c: flash, ADC, watchdog, reset cause and RAM. */
void devices_init(void);
void flash_set(uint32_t address, uint32_t word);
void flash_wear(void);
void reset_cause_set(uint32_t flags);
void ram_stick(uint32_t address);

#endif
