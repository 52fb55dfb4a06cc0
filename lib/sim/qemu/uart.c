/* The UART is QEMU's; BUSY, how long a byte takes, and when one comes are added on the way. */
#include "sim/qemu/machine.h"

#define TIMER_2 0x40032000u /* starts and paces what is sent */
#define UART_0_AT 0x4000C000u
#define TIMER_CTL 0xCu
#define PAGE 0x1000u /* of registers */
#define BYTES 4096   /* on their way; a power of two */

static struct {
  MemoryRegion* real;
  MemoryRegion* timer;
  Chardev* line;
  lockstep_message bytes[BYTES];
  size_t bytes_in;
  size_t bytes_out;
  uint32_t divisor; /* in 1/64 */
  int64_t busy_until_ns;
} uart;

const lockstep_message* uart_next_byte(void) {
  return uart.bytes_out == uart.bytes_in ? NULL : &uart.bytes[uart.bytes_out % BYTES];
}

void uart_hear(void) {
  const uint8_t byte = (uint8_t)uart_next_byte()->value;
  ++uart.bytes_out;
  if (qemu_chr_be_can_write(uart.line) > 0) {
    qemu_chr_be_write(uart.line, &byte, 1);
  } else {
    tell(LOCKSTEP_OVERRUN, byte, 0);
  }
}

void uart_queue(const lockstep_message* byte) {
  if (uart.bytes_in - uart.bytes_out == BYTES) give_up();
  uart.bytes[uart.bytes_in++ % BYTES] = *byte;
}

bool uart_timer_runs(void) {
  return (register_of(uart.timer, TIMER_CTL) & 1u) != 0;
}

bool uart_busy(void) {
  return now() < uart.busy_until_ns;
}

static uint32_t uart_read(uint32_t address) {
  uint32_t data = register_of(uart.real, address);
  if (address == 0x18u && uart_busy()) data |= 1u << 3;
  return data;
}

static void uart_write(uint32_t address, uint32_t data) {
  if (address == 0x24u) uart.divisor = data << 6 | (uart.divisor & 0x3Fu);
  if (address == 0x28u) uart.divisor = (uart.divisor & ~0x3Fu) | data;
  if (address == 0x00u) {
    const int64_t now_ns = now();
    const int64_t byte_ns = (int64_t)uart.divisor * 10 * CYCLE_NS / 4;
    uart.busy_until_ns = (uart.busy_until_ns > now_ns ? uart.busy_until_ns : now_ns) + byte_ns;
    byte_sent((uint8_t)data);
  }
  memory_region_dispatch_write(uart.real, address, data, MO_32, NO_ATTRIBUTES);
}

void uart_init(void) {
  static device registers = {.read = uart_read, .write = uart_write};
  uart.line = qemu_chr_find("line");
  if (uart.line == NULL) give_up();
  uart.real = find(UART_0_AT, "pl011_luminary");
  uart.timer = find(TIMER_2, "stellaris-gptm");
  cover(&registers, UART_0_AT, PAGE);
}
