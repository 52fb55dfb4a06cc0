#include "state/rules.h"

#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <string>
#include <utility>

namespace bushd::state {
namespace {

// "1200 steps (3.0000 mm)"
std::string position_of(const Record& record, const Seen& seen) {
  const std::string steps = std::to_string(record.steps) + " steps";
  return seen.position_text.empty() ? steps : steps + " (" + seen.position_text + ")";
}

// "; last known: 1200 steps (3.0000 mm) at 2026-11-20 17:03:12 UTC"
std::string last_known(const Record& record, const Seen& seen) {
  if (record.utime_us == 0) return {};
  return "; last known: " + position_of(record, seen) +
         (record.at_rest ? " at " : ", in motion, at ") + time_text(record.utime_us);
}

bool same_counter(const Record& record, const Seen& seen) {
  return record.unique_id == seen.unique_id && record.output == seen.output;
}

// Why this is not the counter that the steps were counted by, or not the motor that it counted for.
std::optional<std::string> changed(const Record& record, const Seen& seen) {
  if (record.unique_id != seen.unique_id) {
    return "the MCU with unique id " + seen.unique_id + " has taken the place of that with " +
           record.unique_id + " as MCU " + seen.mcu;
  }
  if (record.output != seen.output) {
    return "it was moved from output " + std::to_string(record.output) + " of MCU " + seen.mcu +
           " to output " + std::to_string(seen.output);
  }
  if (record.steps_per_unit != seen.steps_per_unit) {
    const auto text = [](const std::string& scale) {
      return scale.empty() ? std::string("none") : scale;
    };
    return "its steps_per_unit was changed from " + text(record.steps_per_unit) + " to " +
           text(seen.steps_per_unit);
  }
  return std::nullopt;
}

// Why it may have moved unseen before its MCU booted.
std::optional<std::string> may_have_moved(const Kept& kept, const Seen& seen) {
  if (kept.mark_lost) {
    return "whether it moved when MCU " + seen.mcu + " lost power is not readable from the disk";
  }
  if (!stood(kept)) return "MCU " + seen.mcu + " restarted while it moved";
  if (seen.local) {
    return "MCU " + seen.mcu + " restarted, and people may have moved it by its local inputs";
  }
  return std::nullopt;
}

// Nobody has ever said where a motor at this output stands: that is not known worse than before.
Verdict on_new_name(const Kept& kept, const Seen& seen) {
  const Owner& before = *seen.before;
  Verdict verdict{};
  if (before.record.boot_number != seen.boot_number) verdict.set_steps = before.record.steps;
  if (before.record.trust == Trust::kUnconfirmed && !kept.record) return verdict;
  verdict.trust = Trust::kUncertain;
  verdict.reason = "output " + std::to_string(seen.output) + " of MCU " + seen.mcu +
                   " was motor \"" + before.motor + "\" before" + last_known(before.record, seen);
  return verdict;
}

}  // namespace

void give_up_output(Record& record, const std::string& to) {
  if (record.trust != Trust::kUncertain) {
    record.reason = "its output has become that of motor \"" + to + "\"" + last_known(record, {});
    record.trust = Trust::kUncertain;
  }
  record.unique_id.clear();
  record.at_rest = false;
}

std::string time_text(std::int64_t utime_us) {
  const std::time_t seconds = static_cast<std::time_t>(utime_us / 1'000'000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

Verdict on_connecting(const Kept& kept, const Seen& seen) {
  if (seen.before) return on_new_name(kept, seen);
  if (!kept.record) return {};
  const Record& record = *kept.record;
  const bool same_boot = same_counter(record, seen) && record.boot_number == seen.boot_number;
  Verdict verdict{.trust = record.trust, .reason = record.reason, .set_steps = {}};
  // Also where it is uncertain: the number that people read, and may confirm, goes on.
  if (same_counter(record, seen) && !same_boot) verdict.set_steps = record.steps;

  auto doubt = changed(record, seen);
  if (!doubt && !same_boot) doubt = may_have_moved(kept, seen);
  if (!doubt && same_boot && std::abs(seen.steps - record.steps) > INT32_MAX) {
    // No motor makes so many steps unseen: the counter has gone on at the other end.
    doubt = "MCU " + seen.mcu + " has moved it beyond +-" + std::to_string(INT32_MAX) +
            " steps, where no more are counted";
  }
  if (!doubt && same_boot && !stood(kept) && seen.may_have_overrun) {
    doubt = "its limit switch stopped it immediately, so it may have overrun";
  }
  if (record.trust == Trust::kUncertain) return verdict;
  if (doubt) {
    verdict.trust = Trust::kUncertain;
    verdict.reason = *doubt + last_known(record, seen);
  } else if (!same_boot && record.trust != Trust::kUnconfirmed) {
    verdict.trust = Trust::kRestored;
    verdict.reason = "MCU " + seen.mcu + " has restarted; it stood at " +
                     position_of(record, seen) + ", seen last at " + time_text(record.utime_us);
  }
  return verdict;
}

}  // namespace bushd::state
