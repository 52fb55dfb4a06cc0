#include "skew.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>

#include "times.h"

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

constexpr TimeNs kInStepNs = 3 * kSecond;
constexpr TimeNs kMaxSkewNs = 20'000;
constexpr TimeNs kSilenceNs = 10 * kSecond;
constexpr TimeNs kRateKnownPpm = 2;
constexpr TimeNs kRateUnknownPpm = 100;
constexpr unsigned kRateKnownAfter = 3;
// A correction is spread over ticks, by 1/64 each: 40 us of 2.56 ms.
constexpr int kCorrectionTicks = 16;

}  // namespace

Skew::Skew(const bushd::config::Config& config, const bushd::sim::Bus& bus, const Witness& witness)
    : config_(config),
      bus_(bus),
      witness_(witness),
      tick_ns_(config.buses[0].tick_ns()),
      mcus_(config.mcus.size()) {}

void Skew::heard(TimeNs now_ns, std::size_t index, const bushd_sync& sync) {
  Mcu& mcu = mcus_[index];
  const bool same_master = mcu.last && mcu.last->master == sync.master;
  if (same_master && mcu.last->sync_id == sync.sync_id) return;  // a repeated frame
  if (same_master && sync.follows && mcu.last->sync_id == sync.follow_up_id) {
    mcu.corrected_before_ns = mcu.corrected_ns;
    mcu.corrected_ns = now_ns;
    ++mcu.corrections;
  }
  mcu.last = sync;
}

void Skew::follow(TimeNs now_ns, std::size_t index) {
  Mcu& mcu = mcus_[index];
  const bushd::sim::VirtualMcu& of = bus_.mcu(index);
  if (mcu.boot_number != of.boot_number()) {
    mcu = {};
    mcu.boot_number = of.boot_number();
  }
  // While it is offline nobody keeps it in step, and nothing moves by its clock.
  if (const auto& state = witness_.states()[index]) {
    using bushd::api::McuState;
    mcu.online = state->state != McuState::kOffline && state->state != McuState::kBusy;
  }
  if (!of.running() || !mcu.online || (of.core().flags & BUSHD_FLAG_SYNCED) == 0) {
    mcu.in_step_since_ns.reset();
  } else if (!mcu.in_step_since_ns) {
    mcu.in_step_since_ns = mcu.corrected_ns = mcu.corrected_before_ns = now_ns;
    // It may be the reference from now on, and the bus have another rate.
    for (Mcu& any : mcus_) any.corrections = 0;
  }
}

bool Skew::bound(TimeNs now_ns, std::size_t mcu) const {
  const auto& since_ns = mcus_[mcu].in_step_since_ns;
  return since_ns && now_ns - *since_ns >= kInStepNs;
}

TimeNs Skew::drift_ns(TimeNs now_ns, std::size_t index) const {
  const Mcu& mcu = mcus_[index];
  const bool made_up = now_ns - mcu.corrected_ns > kCorrectionTicks * tick_ns_;
  const TimeNs alone_ns = now_ns - (made_up ? mcu.corrected_ns : mcu.corrected_before_ns);
  // A correction counts when it is made up.
  const unsigned corrections = mcu.corrections - (made_up || mcu.corrections == 0 ? 0u : 1u);
  if (corrections < kRateKnownAfter) return alone_ns / 1'000'000 * kRateUnknownPpm;
  return std::max(TimeNs{0}, alone_ns - kSilenceNs) / 1'000'000 * kRateKnownPpm;
}

TimeNs Skew::difference_ns(std::size_t a, std::size_t b) const {
  const auto ticks = static_cast<std::int32_t>(bus_.mcu(b).core().tick - bus_.mcu(a).core().tick);
  const TimeNs apart_ns = bus_.mcu(b).next_event_ns() - bus_.mcu(a).next_event_ns();
  return std::abs(apart_ns - ticks * tick_ns_);
}

std::optional<std::string> Skew::check(TimeNs now_ns) {
  for (std::size_t i = 0; i < mcus_.size(); ++i) follow(now_ns, i);
  for (std::size_t a = 0; a < mcus_.size(); ++a) {
    if (!bound(now_ns, a)) continue;
    for (std::size_t b = a + 1; b < mcus_.size(); ++b) {
      if (!bound(now_ns, b)) continue;
      const TimeNs drift = drift_ns(now_ns, a) + drift_ns(now_ns, b);
      const TimeNs difference = difference_ns(a, b);
      if (drift == 0) worst_ns_ = std::max(worst_ns_, difference);
      if (difference <= kMaxSkewNs + drift) continue;
      return fmt::format("{} and {} are in step, and their ticks are {} us apart, {} allowed",
                         config_.mcus[a].id, config_.mcus[b].id, difference / 1000,
                         (kMaxSkewNs + drift) / 1000);
    }
  }
  return std::nullopt;
}

}  // namespace bushfaults
