// The keypad node: its image for the ATmega328P runs in simavr, with keys and a display at its
// pins.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include "sim/avr/avr_node.h"

namespace bushd::sim {

class AvrKeypad {
 public:
  // Throws std::runtime_error if the image cannot be read. It boots at time 0.
  explicit AvrKeypad(const std::string& image);

  // In the order of the source: forward, reverse, slower, stop; bit n is key n. Of the other node,
  // bit 0 is the switch and bit 1 the speed key. From now on.
  void hold(std::uint8_t keys);
  // What it has sent: when the stop bit ends, and the byte.
  std::function<void(TimeNs end_ns, std::uint8_t byte)> on_byte;
  // A byte for its display has ended now.
  void receive(std::uint8_t byte) { node_.receive(byte); }
  // Up to this time. Throws std::runtime_error if the program crashes.
  void advance(TimeNs now_ns) { node_.advance(now_ns); }
  // What its four digits show, by the segments that were lit last; '?': no character.
  std::string shown() const;

 private:
  static void on_pin(avr_irq_t* irq, std::uint32_t value, void* param);
  void light(std::uint8_t bit);

  AvrNode node_;
  struct Pin {
    AvrKeypad* keypad;
    std::uint8_t* port;
    std::uint8_t bit;
  };
  std::array<Pin, 16> pins_{};
  std::uint8_t port_b_ = 0;
  std::uint8_t port_d_ = 0;
  std::array<std::uint8_t, 4> segments_{};
};

}  // namespace bushd::sim
