#include "daemon/fronts/keypad.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace bushd::daemon {
namespace {

constexpr std::uint8_t kForward = 0x00;
constexpr std::uint8_t kReverse = 0xFF;
constexpr std::uint8_t kSlower = 0xFE;
constexpr std::uint8_t kStop = 0xFD;

constexpr int kRenewals = 3;  // of a latched jog, in its keepalive time
constexpr std::uint32_t kDisplayUnitUs = 10;
constexpr std::uint32_t kMostShown = 9999;

}  // namespace

// From a request of a direction until its jog has ended, or was refused.
class Keypad::KeypadSession final : public api::Session {
 public:
  explicit KeypadSession(std::string name)
      : Session(api::Transport::kSocket, std::move(name), true) {}

  api::Asker next(const std::shared_ptr<KeypadSession>& self) { return {self, ++number_}; }
  // The request that is made next begins a jog, or changes the one that is under way.
  void begins(int its_direction) {
    if (direction_ == 0) opened_ = number_ + 1;
    direction_ = its_direction;
    refused_ = false;
  }
  void stops() { direction_ = 0; }
  void leave() { gone_ = true; }

  bool gone() const override { return gone_; }
  void answer(std::int64_t number, const api::Reply& reply) override {
    if (std::holds_alternative<api::Refused>(reply)) {
      refused_ = refused_ || number >= opened_;
    } else if (number != opened_ || !api::is_final(reply)) {
      return;
    }
    if (number >= opened_) direction_ = 0;
  }
  int direction() const { return direction_; }
  bool refused() const { return refused_; }

 private:
  std::int64_t number_ = 0;
  std::int64_t opened_ = 0;
  int direction_ = 0;
  bool refused_ = false;
  bool gone_ = false;
};

Keypad::Keypad(const config::Keypad& config, std::string motor, Ask ask)
    : config_(config), motor_(std::move(motor)), ask_(std::move(ask)), delay_us_(config.delay_us) {}

Keypad::~Keypad() = default;

void Keypad::port_opened() {
  session_ = std::make_shared<KeypadSession>("keypad-" + motor_);
  show();
}

void Keypad::port_lost() {
  if (session_) session_->leave();
  session_.reset();
  display_.clear();
}

void Keypad::receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) {
  if (!session_) return;
  for (const std::uint8_t byte : bytes) take(now_us, byte);
}

void Keypad::take(std::int64_t now_us, std::uint8_t byte) {
  switch (byte) {
    case kForward:
      go(now_us, 1);
      break;
    case kReverse:
      go(now_us, -1);
      break;
    case kSlower:
      delay_us_ += config_.slower_us;
      if (delay_us_ > config_.slowest_us) delay_us_ = config_.delay_us;
      if (const int direction = session_->direction(); direction != 0) jog(direction);
      break;
    case kStop:
      ask({.motor = motor_, .per_s = 0, .in_steps = true});
      session_->stops();
      break;
    default:
      return;
  }
  show();
}

void Keypad::go(std::int64_t now_us, int direction) {
  const bool same = session_->direction() == direction;
  heard_us_ = now_us;
  if (same && !config_.latched) return ask({.motor = motor_, .renew = true});
  if (same) return;
  // Before it is asked for: the answer may come at once.
  session_->begins(direction);
  jog(direction);
}

// A motor goes no faster than it is asked to, exactly, and by whole units of its table: of the two
// fractions next to 1 / delay the one below it would cost a unit where the delay is a whole number
// of them.
void Keypad::jog(int direction) {
  const double per_s = std::nextafter(1e6 / delay_us_, std::numeric_limits<double>::max());
  ask({.motor = motor_, .per_s = direction * per_s, .in_steps = true});
}

void Keypad::ask(const api::Jog& jog) {
  api::Jog request = jog;
  request.keepalive_ms = config_.keepalive_ms;
  ask_(session_->next(session_), request);
}

void Keypad::step(std::int64_t now_us) {
  if (now_us < next_wake_us()) return;
  heard_us_ = now_us;
  ask({.motor = motor_, .renew = true});
}

std::int64_t Keypad::next_wake_us() const {
  if (!config_.latched || !session_ || session_->direction() == 0) {
    return std::numeric_limits<std::int64_t>::max();
  }
  return heard_us_ + config_.keepalive_ms * std::int64_t{1000} / kRenewals;
}

void Keypad::show() {
  display_ += session_->refused()
                  ? "----\n"
                  : fmt::format("{:04}\n", std::min(delay_us_ / kDisplayUnitUs, kMostShown));
}

std::string Keypad::take_display() {
  return std::exchange(display_, {});
}

}  // namespace bushd::daemon
