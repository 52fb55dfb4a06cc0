#include "sim/avr/avr_uart_line.h"

#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

extern "C" {
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_interrupts.h>
#include <sim_io.h>
#include <sim_regbit.h>
}

namespace bushd::sim {
namespace {

// Behind the one that simavr holds: the chip's buffer has two, its shift register one more.
constexpr std::size_t kRoom = 2;

avr_uart_t* find_slow(avr_t* avr, char name) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "uart") != 0) continue;
    auto* uart = reinterpret_cast<avr_uart_t*>(io);
    if (uart->name == name) return uart;
  }
  throw std::runtime_error(std::string("simavr: no UART ") + name);
}

}  // namespace

AvrUartLine::AvrUartLine(avr_t* avr, char name, Sent sent)
    : avr_(avr), uart_(find_slow(avr, name)), sent_(std::move(sent)) {
  std::uint32_t flags = 0;
  avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS(static_cast<unsigned>(name)), &flags);
  avr_irq_register_notify(
      avr_io_getirq(avr_, AVR_IOCTL_UART_GETIRQ(static_cast<unsigned>(name)), UART_IRQ_OUTPUT),
      on_byte, this);
}

void AvrUartLine::step() {
  if (uart_->cycles_per_byte != byte_cycles_) {
    byte_cycles_ = uart_->cycles_per_byte = uart_->cycles_per_byte * 10 / 11;
  }
  // simavr forgets the interrupt of a byte that waits behind another one: it gets one at a time.
  uart_fifo_t& fifo = uart_->input;
  if (received_.empty() || fifo.read != fifo.write) return;
  const std::uint16_t value = received_.front();
  received_.pop_front();
  fifo.buffer[fifo.write] = value;
  fifo.write = static_cast<std::uint16_t>((fifo.write + 1) % uart_fifo_fifo_size);
  avr_regbit_setto(avr_, uart_->fe, (value & UART_INPUT_FE) != 0);
  avr_raise_interrupt(avr_, &uart_->rxc);
}

void AvrUartLine::receive(std::uint8_t byte) {
  take(byte);
}

void AvrUartLine::receive_break() {
  take(UART_INPUT_FE);
}

void AvrUartLine::take(std::uint16_t value) {
  if (avr_regbit_get(avr_, uart_->rxen) == 0) return;
  if (received_.size() == kRoom) {
    ++overruns_;
    return;
  }
  received_.push_back(value);
  step();
}

void AvrUartLine::on_byte(avr_irq_t*, std::uint32_t value, void* param) {
  auto& self = *static_cast<AvrUartLine*>(param);
  if (self.sent_) {
    self.sent_(self.avr_->cycle + self.byte_cycles_, static_cast<std::uint8_t>(value));
  }
}

}  // namespace bushd::sim
