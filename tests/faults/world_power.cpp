// What happens to the power, and to the disk: of the PC, of MCUs, of all for a night.
#include <fmt/core.h>

#include <algorithm>

#include "positions.h"
#include "times.h"
#include "world.h"

namespace bushfaults {
namespace {

using bushd::api::Trust;
using bushd::sim::TimeNs;

// Until all that stands is on the disk, also what it had to be told twice.
constexpr TimeNs kSettledNs = 3 * kSecond;
// As after any other trouble; positions are set in MCUs besides, one after the other.
constexpr TimeNs kMorningNs = 10 * kSecond;

}  // namespace

// At once, or in the middle of what the daemon writes next.
void World::cut_power() {
  bushd::sim::Random& random = chance_[static_cast<std::size_t>(FaultKind::kPowerCut)];
  std::string of;
  for (std::size_t mcu = 0; mcu < bus_.mcu_count(); ++mcu) {
    const TimeNs down_ns = random.magnitude(kMs, 2 * kSecond);
    if (random.one_in(3) || !is_up(mcu)) continue;
    take_power_of(mcu, down_ns);
    of += " and of " + config_.mcus[mcu].id;
  }
  if (random.one_in(2)) {
    const auto operations = static_cast<std::uint64_t>(random.magnitude(1, 60));
    host_.kept()->lose_power_after(operations);
    return note_fault(FaultKind::kPowerCut,
                      fmt::format("of the PC{}, in {} writes", of, operations));
  }
  const TimeNs length_ns = random.magnitude(10 * kMs, 3 * kSecond);
  host_.cut_power(now_ns_, now_ns_ + length_ns);
  note_fault(FaultKind::kPowerCut, fmt::format("of the PC for {} ms{}", length_ns / kMs, of));
}

void World::disturb_disk() {
  bushd::sim::Random& random = chance_[static_cast<std::size_t>(FaultKind::kDiskFault)];
  const TimeNs length_ns = random.magnitude(10 * kMs, 5 * kSecond);
  if (random.one_in(2)) {
    host_.kept()->be_broken(now_ns_ + length_ns);
    return note_fault(FaultKind::kDiskFault, fmt::format("fails for {} ms", length_ns / kMs));
  }
  const TimeNs each_ns = random.magnitude(20 * kMs, 2 * kSecond);
  host_.kept()->be_slow(each_ns, now_ns_ + length_ns);
  note_fault(FaultKind::kDiskFault,
             fmt::format("takes {} ms each for {} ms", each_ns / kMs, length_ns / kMs));
}

// All motors stand, and the disk knows it. Then the PC goes, with MCUs or without: in the morning
// what was known is restored, or known where the MCU has counted on, and what was uncertain is so.
void World::night() {
  if (witness_.violation()) return;
  run_until(now_ns_ + kSettledNs);
  if (witness_.violation()) return;
  bushd::sim::Random& random = chance_[static_cast<std::size_t>(FaultKind::kPowerCut)];
  const auto evening = witness_.states();
  std::vector<bool> dark;
  for (std::size_t mcu = 0; mcu < bus_.mcu_count(); ++mcu) {
    dark.push_back(!random.one_in(3) && is_up(mcu));
    if (dark[mcu]) take_power_of(mcu, random.magnitude(kMs, kSecond));
  }
  const bool of_pc = !random.one_in(3);
  recent_.note(now_ns_, of_pc ? "night" : "night; the PC is on");
  if (of_pc) host_.cut_power(now_ns_, now_ns_ + random.magnitude(10 * kMs, kSecond));
  run_until(std::max(host_.faults_over_ns(), mcus_up_ns_));
  const TimeNs began_ns = now_ns_;
  const auto wrong = [&] { return wrong_morning(evening, dark, of_pc); };
  while (now_ns_ < began_ns + kMorningNs && wrong() && !witness_.violation()) {
    run_until(now_ns_ + 100 * kMs);
  }
  if (const auto what = wrong()) witness_.violated(now_ns_, *what);
  for (const auto& state : witness_.states()) {
    if (!state) continue;
    for (const auto& motor : state->motors) ++mornings_[std::string(word(motor.trust))];
  }
}

std::optional<std::string> World::wrong_morning(const Evening& evening,
                                                const std::vector<bool>& dark, bool of_pc) const {
  for (std::size_t mcu = 0; mcu < evening.size(); ++mcu) {
    if (!evening[mcu] || evening[mcu]->state == bushd::api::McuState::kOffline) continue;
    const auto& morning = witness_.states()[mcu];
    if (!morning) return config_.mcus[mcu].id + " is not there after the night";
    for (std::size_t i = 0; i < evening[mcu]->motors.size(); ++i) {
      const bushd::api::MotorState& before = evening[mcu]->motors[i];
      const bushd::api::MotorState& now = morning->motors[i];
      if (before.moving || before.activity != bushd::api::Activity::kResting) continue;
      // Nobody may have told where it stands, or steps were lost: that stays. And a daemon that may
      // move motors without telling the disk leaves nothing behind that is trusted.
      const bool lost = dark[mcu] && of_pc && !config_.state.required;
      const Trust expected = !is_good(before.trust) || lost ? Trust::kUncertain
                             : !dark[mcu]                   ? before.trust
                                                            : Trust::kRestored;
      if (now.trust == expected) continue;
      return fmt::format("{} was {} in the evening, {} {}, and is {} in the morning ({})",
                         before.name, word(before.trust), config_.mcus[mcu].id,
                         dark[mcu] ? "lost power" : "did not lose power", word(now.trust),
                         now.uncertain_reason);
    }
  }
  return std::nullopt;
}

}  // namespace bushfaults
