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
constexpr std::uint8_t kUnused = 0xE0;

}  // namespace

std::optional<Status> status_of(std::uint8_t byte) {
  if ((byte & kUnused) != 0) return std::nullopt;
  return Status{.right_limit = (byte & kRightLimit) != 0,
                .left_limit = (byte & kLeftLimit) != 0,
                .supply_missing = (byte & kSupplyMissing) != 0,
                .not_connected = (byte & kNotConnected) != 0,
                .step_done = (byte & kStepDone) != 0};
}

std::uint8_t header_of(unsigned motor, bool left) {
  return static_cast<std::uint8_t>(kHeader | (left ? kLeft : 0) | motor);
}

void Exchange::step(std::int64_t now_us, unsigned motor, bool left, std::uint64_t delay_ns) {
  // In codes, without the rounding of unit_ns(): delay * 250 F_start / 10^9 s.
  const std::uint64_t per_s = std::uint64_t{kCodesPerStartPeriod} * setup_.start_hz;
  const std::uint64_t codes =
      std::max<std::uint64_t>((delay_ns * per_s + 999'999'999) / 1'000'000'000, 1);
  const std::uint64_t code = std::min<std::uint64_t>(codes, kMaxCode);
  const std::uint64_t held_us = ((codes - code) * 1'000'000 + per_s - 1) / per_s;
  asked_ = Asked{.header = header_of(motor, left),
                 .code = static_cast<std::uint8_t>(code),
                 .send_us = now_us + static_cast<std::int64_t>(held_us)};
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
  const std::int64_t delay_us = asked_->code * static_cast<std::int64_t>(unit_ns()) / 1000 + 1;
  asked_->not_before_us = now_us + delay_us / 2;
  asked_->deadline_us = now_us + line_us + 2 * delay_us + setup_.answer_us;
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
  if (const auto status = status_of(byte)) {
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
