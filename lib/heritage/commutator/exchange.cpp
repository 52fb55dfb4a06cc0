#include "heritage/commutator/exchange.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace bushd::commutator {
namespace {

constexpr std::uint8_t kMotionOver = 0;
constexpr std::uint8_t kHeader = 0x80;
constexpr std::uint8_t kLeft = 0x08;

constexpr std::uint8_t kRightLimit = 1 << 0;
constexpr std::uint8_t kLeftLimit = 1 << 1;
constexpr std::uint8_t kSupplyMissing = 1 << 2;
constexpr std::uint8_t kNotConnected = 1 << 3;
constexpr std::uint8_t kStepDone = 1 << 4;
constexpr std::uint8_t kNoPulse = 1 << 5;
constexpr std::uint8_t kUnused = 0xC0;

// After this a board with a converter takes it for dead: 1 s, by its timer 4 % more at most.
constexpr std::int64_t kWatchUs = 1'040'000;

}  // namespace

std::optional<Status> status_of(std::uint8_t byte, bool has_converter) {
  if ((byte & (has_converter ? kUnused : kUnused | kNoPulse)) != 0) return std::nullopt;
  return Status{.right_limit = (byte & kRightLimit) != 0,
                .left_limit = (byte & kLeftLimit) != 0,
                .supply_missing = (byte & kSupplyMissing) != 0,
                .not_connected = (byte & kNotConnected) != 0,
                .step_done = (byte & kStepDone) != 0,
                .no_pulse = (byte & kNoPulse) != 0};
}

std::uint8_t header_of(unsigned motor, bool left) {
  return static_cast<std::uint8_t>(kHeader | (left ? kLeft : 0) | motor);
}

Exchange::Code Exchange::code_of(std::uint64_t delay_ns) const {
  if (setup_.converter) {
    const std::uint32_t code = converter_code(*setup_.converter, delay_ns);
    if (code > 0) return {static_cast<std::uint8_t>(code), 0};
    // Longer than that of K = 1.
    const std::uint64_t held_ns =
        delay_ns - std::min(delay_ns, converter_period_ns(*setup_.converter, 1));
    return {1, static_cast<std::int64_t>((held_ns + 999) / 1000)};
  }
  // In codes, without the rounding of unit_ns(): delay * 250 F_start / 10^9 s.
  const std::uint64_t per_s = most_steps_per_s();
  const std::uint64_t codes =
      std::max<std::uint64_t>((delay_ns * per_s + 999'999'999) / 1'000'000'000, 1);
  const std::uint64_t code = std::min<std::uint64_t>(codes, kMaxCode);
  const std::uint64_t held_us = ((codes - code) * 1'000'000 + per_s - 1) / per_s;
  return {static_cast<std::uint8_t>(code), static_cast<std::int64_t>(held_us)};
}

std::int64_t Exchange::delay_us(std::uint8_t code) const {
  const std::uint64_t ns =
      setup_.converter ? converter_period_ns(*setup_.converter, code) : code * unit_ns();
  return static_cast<std::int64_t>(ns) / 1000 + 1;
}

// With an offset of a few codes a converter is much faster than it is to be at small K.
std::int64_t Exchange::earliest_us(std::uint8_t code) const {
  return delay_us(code) / (setup_.converter ? 8 : 2);
}

std::int64_t Exchange::latest_us(std::uint8_t code) const {
  return (setup_.converter ? kWatchUs : 2 * delay_us(code)) + setup_.answer_us;
}

std::int64_t Exchange::longest_us() const {
  return setup_.converter ? kWatchUs : delay_us(kMaxCode);
}

void Exchange::step(std::int64_t now_us, unsigned motor, bool left, std::uint64_t delay_ns) {
  const auto [code, held_us] = code_of(delay_ns);
  asked_ = Asked{.header = header_of(motor, left), .code = code, .send_us = now_us + held_us};
  if (held_us == 0) send(now_us);
}

void Exchange::send(std::int64_t now_us) {
  const std::size_t before = out_.size();
  if (selected_ != asked_->header) {
    out_.push_back(kMotionOver);
    out_.push_back(asked_->header);
    selected_ = asked_->header;
  }
  out_.push_back(asked_->code);
  const auto bytes = static_cast<std::int64_t>(out_.size() - before) + 1;
  const std::int64_t line_us = bytes * kBitsPerByte * 1'000'000 / setup_.baud + 1;
  asked_->not_before_us = now_us + earliest_us(asked_->code);
  asked_->deadline_us = now_us + line_us + latest_us(asked_->code);
}

bool Exchange::cancel() {
  if (!asked_ || asked_->deadline_us) return false;
  asked_.reset();
  return true;
}

Exchange::Event Exchange::receive(std::int64_t now_us, std::uint8_t byte) {
  // It may have lain in the adapter until after the deadline: what is here counts.
  Event event;
  if (!asked_ || !asked_->deadline_us || now_us < asked_->not_before_us) {
    event.stray = true;
    return event;
  }
  asked_.reset();
  if (const auto status = status_of(byte, setup_.converter.has_value())) {
    event.answer = Answer{*status};
  } else {
    selected_.reset();
    event.lost = Lost{fmt::format("the board answered with {:#04x}, which is no status", byte)};
  }
  return event;
}

Exchange::Event Exchange::advance(std::int64_t now_us) {
  Event event;
  if (!asked_) return event;
  if (!asked_->deadline_us) {
    if (now_us >= asked_->send_us) send(now_us);
  } else if (now_us >= *asked_->deadline_us) {
    asked_.reset();
    selected_.reset();
    event.lost = Lost{"the board did not answer"};
  }
  return event;
}

std::int64_t Exchange::next_wake_us() const {
  if (!asked_) return std::numeric_limits<std::int64_t>::max();
  return asked_->deadline_us.value_or(asked_->send_us);
}

std::vector<std::uint8_t> Exchange::take_bytes() {
  return std::exchange(out_, {});
}

void Exchange::forget() {
  selected_.reset();
  asked_.reset();
  out_.clear();
}

}  // namespace bushd::commutator
