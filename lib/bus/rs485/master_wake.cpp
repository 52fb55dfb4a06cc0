// When the master has something to do, and from when on it listens.
#include <algorithm>

#include "bus/rs485/master.h"

namespace bushd::link {

std::int64_t Rs485Master::wake_us() const {
  if (!port_open_) return INT64_MAX;
  if (transactions_.open()) {
    std::int64_t urgent_us = std::max(withdrawal_due_us(), answered_by_us());
    if (emergency_.active()) urgent_us = std::min(urgent_us, emergency_.due_us());
    if (streams_.withdraws()) urgent_us = stepped_us_;
    return std::min(transactions_.timeout_us(), std::max(urgent_us, transactions_.quiet_us()));
  }
  std::int64_t wake = begun_ ? stepped_us_ : std::min(synchroniser_.due_us(), withdrawal_due_us());
  if (emergency_.active()) wake = std::min(wake, emergency_.due_us());
  for (const McuIndex i : mcus_.indices()) wake = std::min(wake, wake_us(i));
  return std::max(wake, writer_.room_from_us());
}

// The last answer may have ended when the line is quiet, and be with the adapter still.
std::int64_t Rs485Master::answered_by_us() const {
  return transactions_.quiet_us() + horizon_.held_back_us();
}

// Reports that somebody may wait for are read as they come. All others can wait for the last of
// their poll: until it is there nothing else can be sent.
std::int64_t Rs485Master::decided_from_us() const {
  // More than half of a terminal's buffer of 4 kB is not left to the driver.
  constexpr std::size_t kMostUnread = 2'000;
  const bool much = transactions_.longest_answers() > kMostUnread;
  if (emergency_.active() || !clock().valid() || much) return INT64_MIN;
  for (const McuIndex i : mcus_.indices()) {
    if (awaits_news(i, transactions_.quiet_us())) return INT64_MIN;
  }
  return transactions_.last_answer_us();
}

bool Rs485Master::awaits_news(McuIndex mcu, std::int64_t until_us) const {
  const McuView& view = mcus_[mcu].view;
  if (view.phase == McuPhase::kOffline) return false;
  const unsigned unplanned = view.report.moving & ~unsigned{streams_.active(mcu)};
  if (view.phase == McuPhase::kConnecting || busy(mcu) || uploads(mcu) ||
      streams_.start_is_open(mcu) || streams_.replacement_open(mcu) ||
      (view.report.autonomous | view.report.armed | unplanned) != 0) {
    return true;
  }
  const std::optional<Tick> end = streams_.next_end(mcu);
  return end && *end <= clock().tick_at(until_us) + 1;
}

std::int64_t Rs485Master::withdrawal_due_us() const {
  if (!clock().valid()) return INT64_MAX;
  const std::int64_t free_us = std::max(line_free_us(stepped_us_), writer_.free_us());
  return streams_.withdrawal_due_us(free_us, withdrawal_margin_us());
}

std::int64_t Rs485Master::wake_us(McuIndex mcu) const {
  if (mcus_[mcu].view.phase == McuPhase::kOffline) return connector_.retry_due_us(mcu);
  if (streams_.has_replacement_to_send(mcu) || mcus_[mcu].poll_wanted) return stepped_us_;
  const ProgramLink& program = connector_.program(mcu);
  const bool open = streams_.has_ticks_to_send(mcu) || !connector_.queue(mcu).empty() ||
                    connector_.scratch(mcu).under_way() || program.has_part() ||
                    program.has_request(stepped_us_);
  const std::int64_t program_us = std::min(program.due_us(), program.urgent_due_us());
  return std::min({poller_.due_us(mcu), std::max(program_us, stepped_us_),
                   open ? stepped_us_ + kStreamWakeUs : INT64_MAX});
}

}  // namespace bushd::link
