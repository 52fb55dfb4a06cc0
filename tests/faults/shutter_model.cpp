#include "shutter_model.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

#include "times.h"

namespace bushfaults {
namespace {

constexpr TimeNs kRequestDueNs = 120 * kSecond;  // as of BUSHD-2 (crate_model.cpp)
constexpr TimeNs kTableNs = 20 * kSecond;
constexpr TimeNs kRestNs = kSecond / 2;  // so long at rest, a travel is over
constexpr TimeNs kUnit50Ns = 50'000;     // of delays
constexpr TimeNs kFixedNs = 150 * kMs;   // from a reactor start to the first run
// From the last step until the return may begin: debouncing and some ticks, generously.
constexpr TimeNs kSeenNs = 40 * kMs;
constexpr std::size_t kEdgesRemembered = 256;

// Bits of the request register.
constexpr std::uint32_t kRightLimit = 0x01;
constexpr std::uint32_t kLeftLimit = 0x02;
constexpr std::uint32_t kStepDone = 0x04;
constexpr std::uint32_t kStepNotDone = 0x08;
constexpr std::uint32_t kFailed = 0x10;
constexpr std::uint32_t kOverflow = 0x20;
constexpr std::uint32_t kRequests = 0x3F;
// Bits of the control register; enables have the bits of the requests, but for kStepNotDone.
constexpr std::uint32_t kLeft = 0x08;
constexpr std::uint32_t kFailureEnabled = 0x10;
constexpr std::uint32_t kAutomatic = 0x40;
constexpr std::uint32_t kSecondMode = 0x80;

constexpr int kMostSteps = 126;

// As of a motor that waits for the trigger (starts.cpp), and of a slot (sim/pace.h).
TimeNs tolerance_ns(TimeNs tick_ns, TimeNs delay_ns) {
  return tick_ns / 64 + delay_ns / 63;
}

}  // namespace

std::optional<bushd::MotorId> ShutterPlace::motor(const bushd::config::Config& config) {
  for (const bushd::config::Crate& crate : config.crates) {
    for (const bushd::config::CamacModule& module : crate.modules) {
      if (module.type == bushd::config::CamacModule::Type::kBushd1) return module.motors.front();
    }
  }
  return std::nullopt;
}

void ShutterModel::daemon_started(TimeNs now_ns, bool kept) {
  registers_.daemon_started(now_ns, kept);
  seen_ = possible_ = 0;
  inhibited_ = false;
  now_.reset();
  start_.reset();
}

Wrong ShutterModel::cycle(TimeNs now_ns, const Naf& naf, const Response& response) {
  if (!is_here()) return std::nullopt;
  if (naf.station == 28 && naf.function == 26 && (naf.subaddress == 8 || naf.subaddress == 9)) {
    if (naf.subaddress == 8) {
      stop();
      registers_.initialise();
    }
    clear();
  } else if (naf.station == 30 && naf.subaddress == 9) {
    if (naf.function == 26) inhibited_ = true;
    if (naf.function == 24) inhibited_ = false;
  }
  if (naf.station != kBushd1Station) return std::nullopt;
  if (ModuleRegisters::is_memory(naf)) return memory_cycle(now_ns, naf, response);
  if (naf.function == kRead && naf.subaddress <= 3) {
    if (!response.x || !response.q) return "a register does not answer";
    if (naf.subaddress == 3) return read_requests(response.data);
    return registers_.read(naf, response);
  }
  if (naf.function == kWrite) registers_.write(naf);
  if (naf.subaddress != 0) return std::nullopt;
  if (naf.function == kTestLam) return observe(response.q);
  if (naf.function == kClearLam) clear();
  if (naf.function == kForbid) stop();
  if (naf.function == kPermit && !inhibited_) start(now_ns);
  return std::nullopt;
}

Wrong ShutterModel::memory_cycle(TimeNs now_ns, const Naf& naf, const Response& response) {
  // Q is that before the cycle.
  auto wrong = observe(!response.q);
  const auto held = registers_.memory_cycle(now_ns, naf, response);
  if (registers_.address() == 0) {
    possible_ |= kOverflow;
    now_.reset();
  }
  return wrong ? wrong : held;
}

bool ShutterModel::lam_of(std::uint32_t requests) const {
  const bool failure = (requests & (kStepNotDone | kFailed)) != 0;
  const std::uint32_t others = kRightLimit | kLeftLimit | kStepDone | kOverflow;
  return (failure && (registers_.control() & kFailureEnabled) != 0) ||
         (requests & registers_.control() & others) != 0;
}

// What the requests can be.
std::uint32_t ShutterModel::possible() const {
  if (!start_) return possible_;
  if (!start_->sure) return possible_ | (kRequests & ~kOverflow);
  const std::uint32_t limits = kRightLimit | kLeftLimit;
  return possible_ | limits | (start_->lasts() ? kFailed : kStepDone | kStepNotDone);
}

Wrong ShutterModel::observe(bool lam) {
  if (!is_here()) return std::nullopt;
  if (now_ && lam != lam_of(*now_)) {
    return fmt::format("L is {}, with requests {:#x} and enables {:#x}", lam, *now_,
                       registers_.control());
  }
  if (lam && !lam_of(possible())) return "L, and nothing can have raised it";
  if (!lam && lam_of(seen_)) return "no L any more, and nobody has cleared it";
  return std::nullopt;
}

Wrong ShutterModel::read_requests(std::uint32_t data) {
  const std::uint32_t requests = data & kRequests;
  if ((requests & ~possible()) != 0) {
    return fmt::format("it says {:#x}, and at most {:#x} can have been raised", requests,
                       possible());
  }
  if ((seen_ & ~requests) != 0) {
    return fmt::format("it says {:#x}, and nobody has cleared {:#x}", requests, seen_ & ~requests);
  }
  const std::uint32_t fresh = requests & ~seen_;
  seen_ |= requests;
  now_ = requests;
  if (!start_) return std::nullopt;
  if ((fresh & (kStepDone | kStepNotDone)) != 0) return end_step(fresh);
  if (start_->sure && !start_->lasts() && (fresh & (kRightLimit | kLeftLimit)) != 0 &&
      start_->made == 0) {
    // It was there already, or comes to it now: who can tell.
    start_->sure = false;
  }
  if ((fresh & kFailed) != 0) {
    possible_ |= requests;
    start_->failed = true;
    start_->rests_since_ns.reset();
  }
  return end_travel(requests);
}

Wrong ShutterModel::end_step(std::uint32_t fresh) {
  const Start ended = *start_;
  over();
  if (!ended.sure || ended.disturbed) return std::nullopt;
  if ((fresh & kStepDone) == 0) return std::nullopt;
  ++steps_done_;
  if (ended.made != 1)
    return fmt::format("a step is said to be done, and {} were made", ended.made);
  if (ended.mode == Mode::kSensedStep && stands_ % ShutterPlace::kSensorPeriod != 0) {
    return fmt::format("its sensor is said to have seen the step, and it stands at {}", stands_);
  }
  return std::nullopt;
}

// One that makes a single travel has been to both limits.
Wrong ShutterModel::end_travel(std::uint32_t all) {
  const std::uint32_t both = kRightLimit | kLeftLimit;
  if (!start_ || !start_->sure || start_->mode != Mode::kTravel || start_->cleared) {
    return std::nullopt;
  }
  if ((all & both) != both || (all & kFailed) != 0 || start_->failed || start_->stopped) {
    return std::nullopt;
  }
  const Start ended = *start_;
  over();
  ++travels_;
  if (ended.disturbed || ended.runs == 2) return std::nullopt;
  return fmt::format("it has been to both limits, and has made {} runs of all steps", ended.runs);
}

void ShutterModel::clear() {
  seen_ = 0;
  possible_ = 0;
  now_ = 0;
  if (start_) start_->cleared = true;
}

// What it has raised may not have been seen.
void ShutterModel::over() {
  possible_ |= possible();
  start_.reset();
}

void ShutterModel::stop() {
  if (!start_) return;
  start_->stopped = true;
  start_->rests_since_ns.reset();
}

Wrong ShutterModel::raised(const bushd::api::CamacLam& lam) {
  if (!is_here() || (lam.raised >> (kBushd1Station - 1) & 1) == 0) return std::nullopt;
  if (start_) start_->told = true;
  if (lam_of(possible())) return std::nullopt;
  return "a LAM of BUSHD-1, and nothing can have raised it";
}

void ShutterModel::start(TimeNs now_ns) {
  now_.reset();
  // While it moves F26 has no effect; whether it does, nobody may know.
  if (start_ && start_->sure && !start_->stopped && !start_->failed &&
      start_->mode == Mode::kSynchronous) {
    possible_ |= kRequests & ~kOverflow;  // it may have failed unseen, and this be another one
    start_->sure = false;
    return;
  }
  const bool idle = !start_;
  ++starts_;
  if (start_) possible_ |= possible();
  Start next{.since_ns = now_ns, .sure = idle, .disturbed = others_move_};
  const bool automatic = (registers_.control() & kAutomatic) != 0;
  const bool second = (registers_.control() & kSecondMode) != 0;
  next.mode = automatic ? (second ? Mode::kSynchronous : Mode::kTravel)
                        : (second ? Mode::kSensedStep : Mode::kStep);
  next.left = (registers_.control() & kLeft) != 0;
  const auto word = [this](std::size_t at) {
    const int value = registers_[at] + 256 * registers_[at + 1];
    return std::clamp(value, 1, 30'000) * kUnit50Ns;
  };
  const int steps = registers_[0];
  for (int i = 0; i < std::min(steps, kMostSteps); ++i) {
    next.delays_ns.push_back(word(4 + 2 * static_cast<std::size_t>(i)));
  }
  next.wait_ns = word(2);
  start_ = std::move(next);
}

void ShutterModel::trigger(TimeNs now_ns, bool rising) {
  if (!rising) return;
  if (edges_ns_.size() == kEdgesRemembered) edges_ns_.pop_front();
  edges_ns_.push_back(now_ns);
}

void ShutterModel::disturbed() {
  others_move_ = true;
  rests_since_ns_.reset();
  if (start_) start_->disturbed = true;
}

Wrong ShutterModel::stepped(TimeNs now_ns, bool right, std::int64_t stands) {
  stands_ = stands;
  if (!start_ || !start_->sure || start_->disturbed) return std::nullopt;
  if (!start_->lasts()) {
    if (++start_->made > 1) return "a second step, and one was asked for";
    if (right == start_->left) return "a step in the other direction";
    return std::nullopt;
  }
  if (start_->delays_ns.empty()) return "it travels, and no steps are in its memory";
  const bool whole = start_->made == start_->delays_ns.size();
  if (start_->made == 0 || whole) {
    if (whole) start_->returns = !start_->returns;
    start_->made = 0;
    if (auto wrong = begin_run(now_ns, right)) return wrong;
  } else if (auto wrong = next_step(now_ns, right)) {
    return wrong;
  }
  start_->last_ns = now_ns;
  if (++start_->made == start_->delays_ns.size()) ++start_->runs;
  return std::nullopt;
}

// The first step of a run.
Wrong ShutterModel::begin_run(TimeNs now_ns, bool right) {
  Start& start = *start_;
  const TimeNs tick_ns = config_.buses[0].tick_ns();
  const TimeNs begins_ns = now_ns - start.delays_ns.front();
  start.first_ns = now_ns;
  if (right == (start.left != start.returns)) return "a run in the other direction";
  if (start.returns) {
    const bool synchronous = start.mode == Mode::kSynchronous;
    const TimeNs due_ns = (synchronous ? start.edge_ns : start.last_ns) + start.wait_ns;
    if (begins_ns < due_ns - tick_ns / 2) {
      return fmt::format("it returns {} us too early", (due_ns - begins_ns) / 1000);
    }
    if (due_ns > start.last_ns + kSeenNs && begins_ns > due_ns + tick_ns / 2) {
      return fmt::format("it returns {} us late", (begins_ns - due_ns) / 1000);
    }
    return std::nullopt;
  }
  if (start.mode == Mode::kTravel) {
    if (start.runs == 0) return std::nullopt;
    return "a second travel, and one was asked for";
  }
  const auto edge = std::ranges::find_if(edges_ns_, [&](TimeNs edge_ns) {
    return std::abs(edge_ns + kFixedNs - begins_ns) < tick_ns / 2;
  });
  if (edge == edges_ns_.end()) return "it opens, and no reactor start has come 150 ms before";
  start.edge_ns = *edge;
  ++openings_;
  return std::nullopt;
}

// Steps of a run that is ramped down come later, never earlier.
Wrong ShutterModel::next_step(TimeNs now_ns, bool right) {
  Start& start = *start_;
  if (right == (start.left != start.returns)) return "it turns in the middle of a run";
  const TimeNs tick_ns = config_.buses[0].tick_ns();
  const TimeNs delay_ns = start.delays_ns[start.made];
  const TimeNs apart_ns = now_ns - start.last_ns;
  if (apart_ns < delay_ns - tolerance_ns(tick_ns, delay_ns)) {
    return fmt::format("step {} of a run comes {} us after the one before, and its code says {}",
                       start.made + 1, apart_ns / 1000, delay_ns / 1000);
  }
  if (start.made + 1 < start.delays_ns.size()) return std::nullopt;
  TimeNs due_ns = 0;
  for (std::size_t i = 1; i < start.delays_ns.size(); ++i) due_ns += start.delays_ns[i];
  if (now_ns - start.first_ns <= due_ns + tolerance_ns(tick_ns, due_ns)) return std::nullopt;
  return fmt::format("a run of {} steps takes {} us from the first to the last, not {}",
                     start.delays_ns.size(), (now_ns - start.first_ns) / 1000, due_ns / 1000);
}

// What was stopped, or has failed, is over when its motor rests. A travel that waits for its table
// rests too, and does not look at a stop until it has it: by then the MCU has come to rest, and no
// motion of its motors takes as long as kTableNs.
void ShutterModel::said(TimeNs now_ns, const bushd::api::MotorState& state) {
  const bool rests = state.activity == bushd::api::Activity::kResting && !state.moving;
  if (!rests) rests_since_ns_.reset();
  if (rests && !rests_since_ns_) rests_since_ns_ = now_ns;
  if (rests && now_ns - *rests_since_ns_ >= kRestNs) others_move_ = false;
  if (!start_) return;
  start_->begun = start_->begun || !rests;
  const bool waits = !start_->sure || (start_->lasts() && !start_->begun);
  if (!start_->failed && !start_->stopped) return;
  if (!rests) return start_->rests_since_ns.reset();
  if (!start_->rests_since_ns) start_->rests_since_ns = now_ns;
  if (now_ns - *start_->rests_since_ns >= (waits ? kTableNs : kRestNs)) over();
}

// One that has waited for its table until now may begin yet.
void ShutterModel::calm() {
  if (!start_) return;
  if (start_->stopped || start_->failed) return over();
  start_->sure = false;
}

Wrong ShutterModel::check_deadline(TimeNs now_ns) const {
  constexpr std::uint32_t kAll = kRightLimit | kLeftLimit | kStepDone | kFailureEnabled;
  if (!start_ || !start_->sure || start_->stopped || start_->told || seen_ != 0) {
    return std::nullopt;
  }
  if (start_->mode == Mode::kSynchronous || (registers_.control() & kAll) != kAll)
    return std::nullopt;
  if (now_ns - start_->since_ns <= kRequestDueNs) return std::nullopt;
  return fmt::format("no LAM of BUSHD-1 {} s after a start", kRequestDueNs / kSecond);
}

}  // namespace bushfaults
