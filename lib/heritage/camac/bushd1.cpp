#include "heritage/camac/bushd1.h"

#include <algorithm>
#include <functional>

namespace bushd::camac {
namespace {

enum Request {
  kRightLimit = 1,
  kLeftLimit,
  kStepDone,
  kStepNotDone,
  kTravelFailed,
  kOverflow,
  kRightLevel,
  kLeftLevel
};
// Bits of the control register; those of the other requests have their numbers.
constexpr int kDirection = 4;
constexpr int kFailureEnabled = 5;

}  // namespace

bool rise_and_fall_once(std::span<const std::uint16_t> delays) {
  const auto slower = std::ranges::is_sorted_until(delays, std::greater<>());
  return slower == delays.end() || std::ranges::is_sorted(slower - 1, delays.end());
}

bool Bushd1::lam() const {
  const auto raised = [this](Request request, int enable) {
    return (requests_ & bit(request)) != 0 && is_enabled(enable);
  };
  return raised(kRightLimit, kRightLimit) || raised(kLeftLimit, kLeftLimit) ||
         raised(kStepDone, kStepDone) || raised(kStepNotDone, kFailureEnabled) ||
         raised(kTravelFailed, kFailureEnabled) || raised(kOverflow, kOverflow);
}

std::uint32_t Bushd1::request_register() const {
  return requests_ | (right_limit_ ? bit(kRightLevel) : 0) | (left_limit_ ? bit(kLeftLevel) : 0);
}

void Bushd1::address_overflows() {
  raise(kOverflow);
}

void Bushd1::start() {
  if (is_moving()) return;
  const bool left = is_enabled(kDirection);
  is_enabled(kAutomatic) ? start_travel(left) : start_step(left);
}

void Bushd1::start_step(bool left) {
  if (at_limit(left)) return raise(left ? kLeftLimit : kRightLimit);
  if (!shutter_.step({.left = left, .with_sensor = is_enabled(kSecondMode)})) {
    return raise(kStepNotDone);
  }
  motion_ = Motion{.left = left, .steps = 1};
}

std::uint16_t Bushd1::delay_at(std::size_t address) const {
  return std::clamp<std::uint16_t>(programs().word_at(address), 1, kMostDelay);
}

void Bushd1::start_travel(bool left) {
  const int steps = programs().bytes()[0];
  Travel travel{.left = left,
                .delay = delay_at(kDelayAddress),
                .synchronous = is_enabled(kSecondMode),
                .adjusts = adjusts_};
  for (int i = 0; i < std::min(steps, kMostSteps); ++i) {
    travel.codes.push_back(delay_at(kFirstCode + 2 * static_cast<std::size_t>(i)));
  }
  const char* why = nullptr;
  if (steps == 0 || steps > kMostSteps) {
    why = "the number of steps at address 0 is not 1..126";
  } else if (at_limit(left)) {
    why = "the limit switch that it is to travel to is active";
  }
  if (why != nullptr) shutter_.refuses(why);
  if (why != nullptr || !shutter_.travel(travel)) return raise(kTravelFailed);
  motion_ =
      Motion{.automatic = true, .left = left, .synchronous = travel.synchronous, .steps = steps};
}

void Bushd1::goes_on(std::uint8_t control, int steps) {
  load_control(control);
  motion_ = Motion{.automatic = true,
                   .left = is_enabled(kDirection),
                   .synchronous = is_enabled(kSecondMode),
                   .steps = steps};
}

void Bushd1::stop() {
  if (!motion_ || motion_->stopping) return;
  motion_->stopping = true;
  shutter_.stop();
}

void Bushd1::fail() {
  raise(kTravelFailed);
  stop();
}

void Bushd1::limits(bool right, bool left) {
  const bool reaches_right = right && !right_limit_;
  const bool reaches_left = left && !left_limit_;
  right_limit_ = right;
  left_limit_ = left;
  if (!runs()) return;
  if (reaches_right) raise(kRightLimit);
  if (reaches_left) raise(kLeftLimit);
  const bool early = motion_->automatic && motion_->made < motion_->steps;
  if (early && at_limit(motion_->left) && !motion_->stopping) fail();
}

void Bushd1::end_step(int request) {
  if (!motion_ || motion_->automatic) return;
  if (!motion_->stopping) raise(request);
  motion_.reset();
}

void Bushd1::step_done() {
  end_step(kStepDone);
}

void Bushd1::step_not_done() {
  end_step(kStepNotDone);
}

void Bushd1::run_step_done() {
  if (!motion_ || !motion_->automatic || motion_->stopping) return;
  if (motion_->made == motion_->steps || at_limit(motion_->left)) return fail();
  ++motion_->made;
}

void Bushd1::run_ends() {
  if (!motion_ || !motion_->automatic || motion_->stopping) return;
  const bool arrived = at_limit(motion_->left) && !at_limit(!motion_->left);
  if (motion_->made != motion_->steps || !arrived) return fail();
  motion_->left = !motion_->left;
  motion_->made = 0;
  motion_->returns = !motion_->returns;
  if (!motion_->returns && !motion_->synchronous) motion_.reset();
}

void Bushd1::stands() {
  if (!motion_) return;
  if (!motion_->stopping) raise(motion_->automatic ? kTravelFailed : kStepNotDone);
  motion_.reset();
}

}  // namespace bushd::camac
