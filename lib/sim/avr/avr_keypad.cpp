#include "sim/avr/avr_keypad.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace bushd::sim {
namespace {

constexpr int kKeys = 4;
// Port B has segment g, and the digits from bit 1 on. Port D has segments a to f from bit 2 on.
constexpr int kFirstDigit = 1;
constexpr int kFirstSegment = 2;

// As a data sheet of such a display draws them: a at the top, clockwise to f, g in the middle. A Z
// looks like a 2.
constexpr std::array<std::pair<std::uint8_t, char>, 13> kCharacters{{{0b0111111, '0'},
                                                                     {0b0000110, '1'},
                                                                     {0b1011011, '2'},
                                                                     {0b1001111, '3'},
                                                                     {0b1100110, '4'},
                                                                     {0b1101101, '5'},
                                                                     {0b1111101, '6'},
                                                                     {0b0000111, '7'},
                                                                     {0b1111111, '8'},
                                                                     {0b1101111, '9'},
                                                                     {0b1110001, 'F'},
                                                                     {0b1000000, '-'},
                                                                     {0, ' '}}};

}  // namespace

AvrKeypad::AvrKeypad(const std::string& image)
    : node_(image, [this](TimeNs end_ns, std::uint8_t byte) {
        if (on_byte) on_byte(end_ns, byte);
      }) {
  for (std::size_t i = 0; i < pins_.size(); ++i) {
    const bool is_b = i < 8;
    pins_[i] = {this, is_b ? &port_b_ : &port_d_, static_cast<std::uint8_t>(1 << i % 8)};
    node_.watch(is_b ? 'B' : 'D', static_cast<int>(i % 8), on_pin, &pins_[i]);
  }
  hold(0);
}

// Keys close to ground.
void AvrKeypad::hold(std::uint8_t keys) {
  node_.drive('C', (1 << kKeys) - 1, static_cast<std::uint8_t>(~keys));
}

// An edge calls twice, with other bits above the level.
void AvrKeypad::on_pin(avr_irq_t*, std::uint32_t value, void* param) {
  const auto& pin = *static_cast<Pin*>(param);
  *pin.port =
      static_cast<std::uint8_t>((value & 1) != 0 ? *pin.port | pin.bit : *pin.port & ~pin.bit);
  if (pin.port == &pin.keypad->port_b_ && (value & 1) != 0) pin.keypad->light(pin.bit);
}

// Pins of a port change one after the other, from bit 0 on: those of segments before their digit.
void AvrKeypad::light(std::uint8_t bit) {
  const int digit = std::countr_zero(bit) - kFirstDigit;
  if (digit < 0 || digit >= static_cast<int>(segments_.size())) return;
  segments_[static_cast<std::size_t>(digit)] =
      static_cast<std::uint8_t>((port_d_ >> kFirstSegment & 0x3F) | (port_b_ & 1) << 6);
}

std::string AvrKeypad::shown() const {
  std::string text;
  for (const std::uint8_t lit : segments_) {
    const auto* found =
        std::ranges::find(kCharacters, lit, &decltype(kCharacters)::value_type::first);
    text += found != kCharacters.end() ? found->second : '?';
  }
  return text;
}

}  // namespace bushd::sim
