// What is wrong with lines, from the errors that daemon and MCUs count: where they are counted
// tells where the fault is.
//
// An MCU counts what reaches it broken, the daemon what reaches it broken. A bad end of the line
// (no termination, A and B swapped, no common ground) is heard by all; a bad stub, plug or
// transceiver by one.
#include <fmt/format.h>

#include <algorithm>

#include "diagnosis.h"

namespace bushctl::doctor {
namespace {

namespace api = bushd::api;

// Errors in answers. At the first a repair now and then, as a lamp that is switched on makes them;
// at the second repairs take a noticeable part of the bus.
constexpr double kNoisy = 1e-4;
constexpr double kBad = 1e-2;
constexpr std::uint64_t kFew = 3;  // errors that say nothing
constexpr std::int64_t kSlowUs = 10'000;

constexpr const char* kEnds =
    "120 ohm at both ends of the pair and nowhere else, A to A and B to B, a common ground";

std::uint64_t answers_of(const api::HealthSnapshot& bus) {
  std::uint64_t sum = 0;
  for (const auto& column : bus.latency) sum += column.answers;
  return sum;
}

double rate(std::uint64_t errors, std::uint64_t answers) {
  if (errors <= kFew) return 0;
  return static_cast<double>(errors) / static_cast<double>(errors + answers);
}

Level level_of(double errors_per_answer) {
  return errors_per_answer >= kBad ? Level::kError : Level::kWarning;
}

// What it has heard broken, and what of it was not heard.
std::uint64_t errors_of(const api::McuHealth& mcu) {
  return mcu.crc_errors + mcu.timeouts;
}

struct Bus {
  const api::HealthSnapshot& health;
  const api::HealthSnapshot* before;  // null: nobody has looked for a while
  double watched_s;

  std::uint64_t answers() const { return answers_of(health); }
  // ", 5 in 2 s of looking"
  std::string of_late(std::uint64_t then, std::uint64_t now) const {
    if (before == nullptr) return {};
    return fmt::format(", {} in {:.0f} s of looking", now - std::min(then, now), watched_s);
  }
};

std::string noise_text(const Bus& bus, const api::McuHealth& mcu) {
  std::uint64_t then = 0;
  if (bus.before != nullptr) {
    const auto found = std::ranges::find(bus.before->mcus, mcu.mcu, &api::McuHealth::mcu);
    if (found != bus.before->mcus.end()) then = errors_of(*found);
  }
  return fmt::format("{}: {} frames reached it broken, {} requests were not answered{}", mcu.mcu,
                     mcu.crc_errors, mcu.timeouts, bus.of_late(then, errors_of(mcu)));
}

void check_noise(const Bus& bus, Findings& out) {
  const std::uint64_t each = bus.answers() / std::max<std::size_t>(bus.health.mcus.size(), 1);
  std::vector<const api::McuHealth*> noisy;
  double worst = 0;
  for (const api::McuHealth& mcu : bus.health.mcus) {
    // One that was never heard is offline, which is told elsewhere.
    const double errors = mcu.unique_id.empty() ? 0 : rate(errors_of(mcu), each);
    if (errors < kNoisy) continue;
    noisy.push_back(&mcu);
    worst = std::max(worst, errors);
  }
  if (noisy.size() > 1 && noisy.size() == bus.health.mcus.size()) {
    out.push_back(
        {level_of(worst), "bus",
         fmt::format("{}: all {} MCUs hear a noisy bus; the worst, {}", bus.health.bus,
                     noisy.size(),
                     noise_text(bus, **std::ranges::max_element(
                                         noisy, {}, [](auto* mcu) { return errors_of(*mcu); }))),
         std::string("the bus as a whole: ") + kEnds});
    return;
  }
  for (const api::McuHealth* mcu : noisy) {
    out.push_back({level_of(rate(errors_of(*mcu), each)), "bus", noise_text(bus, *mcu),
                   "this MCU's part of the bus: its plug, stub (short) and transceiver; if it is "
                   "at the end, the 120 ohm there"});
  }
}

void check_reception(const Bus& bus, Findings& out) {
  const api::HealthSnapshot& health = bus.health;
  const double errors = rate(health.crc_errors, bus.answers());
  if (errors >= kNoisy) {
    const std::uint64_t then = bus.before == nullptr ? 0 : bus.before->crc_errors;
    out.push_back({level_of(errors), "bus",
                   fmt::format("{}: {} answers reached the PC broken{}", health.bus,
                               health.crc_errors, bus.of_late(then, health.crc_errors)),
                   std::string("the PC's end: the adapter and its 120 ohm; then ") + kEnds});
  }
  if (health.two_masters) {
    out.push_back({Level::kError, "bus", health.bus + ": another master talks on the bus",
                   "end the other program on this bus, bushd, bushctl or another one: on this PC "
                   "or another"});
  }
  if (health.recent_latency_us >= kSlowUs) {
    out.push_back({Level::kWarning, "bus",
                   fmt::format("{}: answers come {:.1f} ms late", health.bus,
                               static_cast<double>(health.recent_latency_us) / 1000),
                   "the adapter's latency_timer should be 1 (udev rules of bushd's package); else "
                   "this PC is too busy"});
  }
}

void check_mcu(const api::McuHealth& mcu, Findings& out) {
  if (mcu.restarts > 0) {
    const bool supply = mcu.reset_cause == "brown-out" || mcu.reset_cause == "power-on";
    out.push_back({Level::kWarning, "mcu",
                   fmt::format("{} has restarted {} times; the last reset was by {}", mcu.mcu,
                               mcu.restarts, mcu.reset_cause.empty() ? "?" : mcu.reset_cause),
                   supply ? "look at its supply: does the voltage drop when motors start?"
                          : "'bushctl health' counts them; a watchdog reset is worth a report",
                   mcu.mcu, "MCUs have restarted"});
  }
  if (mcu.ramp_downs > 0 || mcu.missed_ticks > 0) {
    out.push_back({Level::kWarning, "mcu",
                   fmt::format("{}: motors ran out of ticks {} times, {} ticks were sent and not "
                               "received",
                               mcu.mcu, mcu.ramp_downs, mcu.missed_ticks),
                   "the bus is noisy (above), or this PC stood still for 0.3 s: run less on it "
                   "(docs/troubleshooting.md, A heavily loaded PC)",
                   mcu.mcu, "MCUs ran out of ticks"});
  }
}

}  // namespace

Findings check_buses(const Observations& seen) {
  Findings out;
  if (!seen.daemon.unreachable.empty()) return out;
  const auto before_of = [&](const std::string& bus) -> const api::HealthSnapshot* {
    if (seen.daemon.later.empty()) return nullptr;
    for (const auto& message : seen.daemon.status.healths) {
      if (message.snapshot.bus == bus) return &message.snapshot;
    }
    return nullptr;
  };
  for (const api::HealthSnapshot& health : newest_healths(seen.daemon)) {
    const Bus bus{health, before_of(health.bus), seen.daemon.watched_s};
    const std::size_t found = out.size();
    if (health.port_state != "open") {
      out.push_back({Level::kError, "bus",
                     fmt::format("{}: the port is not open: {}", health.bus, health.port_state),
                     "see 'port' above; bushd tries it again twice a second"});
      continue;
    }
    check_noise(bus, out);
    check_reception(bus, out);
    for (const api::McuHealth& mcu : health.mcus) check_mcu(mcu, out);
    if (out.size() > found) continue;
    out.push_back({Level::kOk, "bus",
                   fmt::format("{}: {} answers, errors within what a bus may have", health.bus,
                               bus.answers()),
                   ""});
  }
  return out;
}

}  // namespace bushctl::doctor
