#include "heritage/camac/bushd2.h"

#include <algorithm>
#include <utility>

namespace bushd::camac {
namespace {

// Bits of the control register.
constexpr int kOverflowEnabled = 5;
constexpr int kFaultEnabled = 6;
constexpr int kEndEnabled = 7;
constexpr int kDirection = 8;
constexpr int kMotorMask = 0x1F;

// Bits of the status.
constexpr unsigned kRightLimit = 0x01;
constexpr unsigned kLeftLimit = 0x02;
constexpr unsigned kSupplyMissing = 0x04;
constexpr unsigned kNotConnected = 0x08;
constexpr unsigned kStepDone = 0x10;
constexpr int kStatusBits = 8;
constexpr std::uint32_t kReceivedMask = 3;

}  // namespace

std::size_t codes_used(const Program& program) {
  return std::min<std::size_t>((program.steps + 1) / 2, program.codes.size());
}

std::uint8_t code_of_step(const Program& program, std::uint32_t step) {
  const std::uint32_t last = static_cast<std::uint32_t>(program.codes.size()) - 1;
  return program.codes[std::min({step, program.steps - 1 - step, last})];
}

bool Bushd2::lam() const {
  return (overflow_ && is_enabled(kOverflowEnabled) && !is_moving()) ||
         (fault_ && is_enabled(kFaultEnabled)) || (ended_ && is_enabled(kEndEnabled));
}

std::uint32_t Bushd2::request_register() const {
  return status_ | received_ << kStatusBits;
}

void Bushd2::clear_lam() {
  overflow_ = false;
  fault_ = false;
  ended_ = false;
}

void Bushd2::clear_requests() {
  clear_lam();
  status_ = 0;
  received_ = 0;
}

Program Bushd2::program() const {
  Program program;
  program.motor = control() & kMotorMask;
  program.page = program.motor / kMotorsPerPage;
  program.left = is_enabled(kDirection);
  const std::size_t page = static_cast<std::size_t>(program.page) * kPageBytes;
  program.steps = programs().word_at(page);
  const auto codes = programs().bytes().subspan(page + kFirstCode, kCodes);
  for (const std::uint8_t code : codes) program.codes.push_back(std::max<std::uint8_t>(code, 1));
  return program;
}

void Bushd2::start() {
  if (is_moving()) return;
  Exchange exchange{.program = program()};
  status_ = 0;
  received_ = 0;
  if (exchange.program.steps == 0) {
    ended_ = true;
    return;
  }
  const MotorStatus status = motors_.status(exchange.program.motor);
  if (status.bars(exchange.program.left)) {
    receive(1, status, false);
    fault_ = true;
  } else if (!motors_.move(exchange.program)) {
    fault_ = true;
  } else {
    exchange_ = std::move(exchange);
  }
}

void Bushd2::goes_on(std::uint8_t control, std::uint32_t steps, std::uint32_t answered) {
  load_control(control);
  Exchange exchange{.program = program(), .answered = answered};
  exchange.program.steps = steps;
  exchange_ = std::move(exchange);
}

void Bushd2::stop() {
  if (!exchange_ || exchange_->stopping) return;
  exchange_->stopping = true;
  motors_.stop(exchange_->program.motor);
}

void Bushd2::receive(std::uint32_t messages, const MotorStatus& status, bool step_done) {
  const unsigned bits = (status.right_limit ? kRightLimit : 0) |
                        (status.left_limit ? kLeftLimit : 0) |
                        (status.supply_missing ? kSupplyMissing : 0) |
                        (status.not_connected ? kNotConnected : 0) | (step_done ? kStepDone : 0);
  status_ = static_cast<std::uint8_t>(bits);
  received_ = (received_ + messages) & kReceivedMask;
}

void Bushd2::count_position(const Program& program, std::uint32_t steps) {
  const auto page = static_cast<std::size_t>(program.page) * kPageBytes;
  const auto number = static_cast<std::size_t>(program.motor % kMotorsPerPage);
  const std::size_t at = page + kFirstPosition + 2 * number;
  const std::uint32_t before = programs().word_at(at);
  programs().set_word_at(
      at, static_cast<std::uint16_t>(program.left ? before - steps : before + steps));
}

void Bushd2::answer(std::uint32_t steps, const MotorStatus& status) {
  if (!exchange_) return;
  Exchange& exchange = *exchange_;
  const std::uint32_t made = std::min(steps, exchange.program.steps - exchange.answered);
  receive(std::max(made, 1U), status, made > 0);
  exchange.answered += made;
  count_position(exchange.program, made);
  const bool all = exchange.answered == exchange.program.steps;
  if (all || status.bars(exchange.program.left)) {
    ended_ |= all && !exchange.stopping;
    fault_ |= !all;
    exchange_.reset();
  }
}

void Bushd2::ends(const MotorStatus& status, std::uint32_t unanswered) {
  if (!exchange_) return;
  count_position(exchange_->program, unanswered);
  if (status.any()) receive(1, status, false);
  fault_ |= !exchange_->stopping || status.bars(exchange_->program.left);
  exchange_.reset();
}

}  // namespace bushd::camac
