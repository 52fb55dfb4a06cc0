// An ATmega328P whose image runs in simavr, with one slow line: what the keypad node and the
// commutator board have in common.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "sim/avr/avr_uart_line.h"
#include "sim/edge.h"

struct avr_t;
struct avr_irq_t;

namespace bushd::sim {

class AvrNode {
 public:
  using Sent = std::function<void(TimeNs end_ns, std::uint8_t byte)>;

  // What it sends goes to `sent`: when the stop bit ends, and the byte. Throws std::runtime_error
  // if the image cannot be read. It boots at time 0.
  AvrNode(const std::string& image, Sent sent);
  ~AvrNode();
  AvrNode(const AvrNode&) = delete;
  AvrNode& operator=(const AvrNode&) = delete;

  TimeNs time_ns() const;
  // Up to this time. Throws std::runtime_error if the program crashes.
  void advance(TimeNs now_ns);
  // A byte, or one with a framing error, has ended now.
  void receive(std::uint8_t byte) { line_->receive(byte); }
  void receive_break() { line_->receive_break(); }

  using Notify = void (*)(avr_irq_t* irq, std::uint32_t value, void* param);
  // Changes of a pin; an edge calls twice, with other bits above the level.
  void watch(char port, int bit, Notify notify, void* param);
  // Calls `wake` at this time, or at once if that is over, and again at each later cycle that it
  // returns; 0: no more. Asked for again: in place of the time before. A reset forgets it.
  using Wake = std::uint64_t (*)(avr_t* avr, std::uint64_t cycle, void* param);
  void wake_at(TimeNs time_ns, Wake wake, void* param);
  // Drives those of the pins of a port that the mask has, and no others, from now on. A pin that
  // counts edges is among `counting`: it is not told its level anew.
  void drive(char port, std::uint8_t mask, std::uint8_t levels, std::uint8_t counting = 0);

  // Jumps into an endless loop, until the watchdog ends it. Throws std::runtime_error if the image
  // has none.
  void hang();

 private:
  avr_t* avr_;
  std::unique_ptr<AvrUartLine> line_;
};

}  // namespace bushd::sim
