#include "sim/avr/avr_board.h"

#include <algorithm>

namespace bushd::sim {
namespace {

// Port C has the windings. Port D has the number of the motor, and the strobe at whose rising edge
// the latch of that motor takes them; and two inputs, as port B has three.
constexpr std::uint8_t kWindingsC = 0x0F;
constexpr int kNumberShift = 2;
constexpr std::uint8_t kSupplyD = 0x40;
// Without a converter the strobe is the first and the input of switches the other; with one the
// input of its pulses is the first and the strobe the other.
constexpr std::uint8_t kFirstD = 0x20;
constexpr std::uint8_t kOtherD = 0x80;
// The code for the DAC, and the clock at whose rising edge its latch takes it.
constexpr std::uint8_t kLowCodeC = 0x3F;
constexpr std::uint8_t kHighCodeB = 0x18;
constexpr std::uint8_t kCodeClockB = 0x20;
// A pulse of the converter lasts so long.
constexpr std::uint64_t kPulseCycles = 80;
constexpr std::uint8_t kRightB = 1;
constexpr std::uint8_t kLeftB = 2;
constexpr std::uint8_t kConnectedB = 4;

}  // namespace

AvrBoard::AvrBoard(const std::string& image, std::uint32_t baud, std::uint32_t start_hz,
                   const std::optional<FrequencyConverter>& converter, EdgeSink* edges,
                   std::size_t mcu)
    : byte_ns_(10'000'000'000 / baud),
      motors_(edges, mcu),
      switches_(start_hz),
      converter_(converter),
      port_b_(kCodeClockB),
      port_d_(converter ? kOtherD : kFirstD),
      node_(image,
            [this](TimeNs end_ns, std::uint8_t byte) { from_board_.push_back({end_ns, byte}); }) {
  for (std::size_t i = 0; i < pins_.size(); ++i) {
    const std::size_t port = i / 8;
    pins_[i] = {this, std::array{&port_b_, &port_c_, &port_d_}[port],
                static_cast<std::uint8_t>(1 << i % 8)};
    node_.watch("BCD"[port], static_cast<int>(i % 8), on_pin, &pins_[i]);
  }
  present();
  if (converter_) await_pulse();
}

void AvrBoard::enqueue(TimeNs now_ns, int value) {
  const TimeNs free_ns = to_board_.empty() ? now_ns : std::max(now_ns, to_board_.back().at_ns);
  to_board_.push_back({free_ns + byte_ns_, value});
}

void AvrBoard::send(TimeNs now_ns, std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) enqueue(now_ns, byte);
}

void AvrBoard::send_break(TimeNs now_ns) {
  enqueue(now_ns, kBreak);
}

std::vector<std::uint8_t> AvrBoard::advance(TimeNs now_ns) {
  present();
  for (; !to_board_.empty() && to_board_.front().at_ns <= now_ns; to_board_.pop_front()) {
    const Byte byte = to_board_.front();
    node_.advance(byte.at_ns);
    if (byte.value == kBreak) {
      node_.receive_break();
    } else {
      node_.receive(static_cast<std::uint8_t>(byte.value));
    }
  }
  node_.advance(now_ns);
  if (fault_) std::rethrow_exception(fault_);
  now_ns_ = now_ns;
  std::vector<std::uint8_t> arrived;
  for (; !from_board_.empty() && from_board_.front().at_ns <= now_ns; from_board_.pop_front()) {
    arrived.push_back(static_cast<std::uint8_t>(from_board_.front().value));
  }
  return arrived;
}

// An edge calls twice.
void AvrBoard::on_pin(avr_irq_t*, std::uint32_t value, void* param) {
  const auto& pin = *static_cast<Pin*>(param);
  const bool level = (value & 1) != 0;
  if (level == ((*pin.port & pin.bit) != 0)) return;
  *pin.port ^= pin.bit;
  AvrBoard& board = *pin.board;
  if (pin.port == &board.port_b_ && board.converter_) {
    if (pin.bit == kCodeClockB && level) board.take_code();
  }
  if (pin.port != &board.port_d_) return;
  if (pin.bit == (board.converter_ ? kOtherD : kFirstD) && level) board.take_windings();
  if ((pin.bit & 7 << kNumberShift) != 0) board.present();
}

void AvrBoard::take_code() {
  const unsigned high = (port_b_ & kHighCodeB) >> 3;
  converter_->set_code(node_.time_ns(),
                       static_cast<std::uint8_t>(high << 6 | (port_c_ & kLowCodeC)));
  await_pulse();
}

void AvrBoard::set_converter(const FrequencyConverter::Character& character) {
  converter_.value().set_character(node_.time_ns(), character);
  await_pulse();
}

// While one lasts, its end is awaited.
void AvrBoard::await_pulse() {
  if (pulse_is_high_) return;
  const TimeNs next_ns = converter_->next_pulse_ns();
  if (next_ns != FrequencyConverter::kNever) node_.wake_at(next_ns, on_time, this);
}

std::uint64_t AvrBoard::on_time(avr_t*, std::uint64_t cycle, void* param) {
  return static_cast<AvrBoard*>(param)->pulse(cycle);
}

std::uint64_t AvrBoard::pulse(std::uint64_t cycle) {
  const std::uint64_t before = converter_->pulses();
  converter_->advance(node_.time_ns());
  if (pulse_is_high_ || converter_->pulses() != before) {
    pulse_is_high_ = !pulse_is_high_;
    present();
    if (pulse_is_high_) return cycle + kPulseCycles;
  }
  await_pulse();
  return 0;
}

unsigned AvrBoard::number() const {
  return static_cast<unsigned>(port_d_ >> kNumberShift) % BoardMotors::kMotors;
}

void AvrBoard::take_windings() {
  const std::uint8_t windings = port_c_ & kWindingsC;
  ++latched_;
  latches_.at(number()) = windings;
  try {
    motors_.switch_windings(node_.time_ns(), number(), windings);
  } catch (...) {
    if (!fault_) fault_ = std::current_exception();
  }
  present();
}

// What the multiplexers let through. Contacts close to ground.
void AvrBoard::present() {
  const unsigned motor = number();
  unsigned closed = 0;
  if (motors_.at_right_limit(motor)) closed |= kRightB;
  if (motors_.at_left_limit(motor)) closed |= kLeftB;
  if (motors_.motor(motor).connected) closed |= kConnectedB;
  // Resistors hold the strobe, and the clock of the code, high while nobody drives them.
  node_.drive('B', kRightB | kLeftB | kConnectedB | kCodeClockB,
              static_cast<std::uint8_t>(~closed));
  closed = 0;
  if (motors_.supply) closed |= kSupplyD;
  if (converter_ && !pulse_is_high_) closed |= kFirstD;
  if ((switches_ >> motor & 1) != 0) closed |= kOtherD;
  node_.drive('D', kSupplyD | kOtherD | kFirstD, static_cast<std::uint8_t>(~closed),
              converter_ ? kFirstD : 0);
}

}  // namespace bushd::sim
