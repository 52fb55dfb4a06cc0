// One slow line at a UART of a chip in simavr, byte by byte with the cycles at which they end.
//
// simavr takes 11 bit times a byte, gives a byte to the program only a byte time after it has come,
// and has room for 64: here it is 10, at once, and as many as the chip has.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>

struct avr_t;
struct avr_irq_t;
struct avr_uart_t;

namespace bushd::sim {

class AvrUartLine {
 public:
  // What the program has sent: the cycle at which its stop bit ends, and the byte.
  using Sent = std::function<void(std::uint64_t end_cycle, std::uint8_t byte)>;

  // `name`: '0' .. '3'. `avr` outlives it, and `sent` is not called later.
  AvrUartLine(avr_t* avr, char name, Sent sent);
  AvrUartLine(const AvrUartLine&) = delete;
  AvrUartLine& operator=(const AvrUartLine&) = delete;

  // Before the program goes on, a little at a time.
  void step();
  // A byte has come to its end; or what was to be its stop bit is low. One that has no room is
  // lost.
  void receive(std::uint8_t byte);
  void receive_break();
  void reset() { received_.clear(); }
  // Bytes that had no room.
  std::uint64_t overruns() const { return overruns_; }

 private:
  void take(std::uint16_t value);
  static void on_byte(avr_irq_t* irq, std::uint32_t value, void* param);

  avr_t* avr_;
  avr_uart_t* uart_;
  Sent sent_;
  std::uint64_t byte_cycles_ = 0;
  std::deque<std::uint16_t> received_;  // that the program has not been given yet
  std::uint64_t overruns_ = 0;
};

}  // namespace bushd::sim
