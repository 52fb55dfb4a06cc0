// Polls: one request for the reports of many MCUs, each in a slot of its own, so that the adapter's
// latency is paid once. Whoever was silent last time answers first: if it is silent again, the one
// after it ends the waiting.
#include <algorithm>

#include "link/master.h"
#include "link/master_limits.h"

namespace bushd::link {
namespace {

// Nothing else is sent meanwhile; queues that have run low must not wait for longer.
constexpr std::int64_t kMaxCycleUs = 60'000;
constexpr std::int64_t kUnitUs = BUSHD_REPLY_UNIT_NS / 1000;

}  // namespace

bool Master::send_wanted_poll(std::int64_t now_us) {
  if (std::none_of(mcus_.begin(), mcus_.end(), [](const Mcu& mcu) { return mcu.poll_now; })) {
    return false;
  }
  const bool doubtful = std::any_of(mcus_.begin(), mcus_.end(),
                                    [](const Mcu& mcu) { return mcu.poll_now && mcu.silent != 0; });
  std::vector<std::size_t> asked;
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    const Mcu& mcu = mcus_[i];
    // Those whose turn comes soon are asked along, and all if one may be silent: somebody must
    // answer after it.
    const bool soon = doubtful || mcu.poll_due_us <= now_us + kPollPeriodUs / 2;
    const bool along = mcu.view.phase != McuPhase::kOffline && soon;
    if (mcu.poll_now || along) asked.push_back(i);
  }
  std::stable_sort(asked.begin(), asked.end(), [this](std::size_t a, std::size_t b) {
    const auto rank = [this](std::size_t i) {
      return std::pair{mcus_[i].silent == 0, !mcus_[i].poll_now};
    };
    return rank(a) < rank(b);
  });
  std::vector<bushd_poll_entry> entries;
  std::vector<std::int64_t> ends_us;  // of the answers, from the poll's end
  std::int64_t begin_us = kFirstSlotUs;
  for (const std::size_t i : asked) {
    const std::int64_t end_us =
        begin_us +
        line_us(BUSHD_REPORT_SIZE(mcus_[i].view.identity.motors) + BUSHD_FRAME_OVERHEAD + 1);
    const bool full = entries.size() == BUSHD_POLL_MAX_ENTRIES || end_us > kMaxCycleUs;
    if (full && !entries.empty()) break;
    const auto units = static_cast<std::uint16_t>((begin_us + kUnitUs - 1) / kUnitUs);
    entries.push_back({mcus_[i].setup.address, units});
    ends_us.push_back(end_us);
    begin_us = end_us + kSlotGuardUs;
  }
  asked.resize(entries.size());
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  const std::size_t size =
      bushd_encode_poll(entries.data(), static_cast<std::uint8_t>(entries.size()), payload.data());
  send(now_us, BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, {payload.data(), size});
  exchange_ = Exchange{.type = BUSHD_MSG_POLL,
                       .tag = tag_,
                       .awaited = {},
                       .sent_us = line_free_us_,
                       .identities = {}};
  for (std::size_t n = 0; n < asked.size(); ++n) {
    Mcu& mcu = mcus_[asked[n]];
    mcu.poll_now = false;
    mcu.poll_due_us = now_us + kPollPeriodUs;
    exchange_->awaited.push_back({.mcu = asked[n], .expected_us = line_free_us_ + ends_us[n]});
  }
  // An MCU may begin late by the guard.
  exchange_->line_quiet_us = line_free_us_ + ends_us.back() + kSlotGuardUs;
  exchange_->timeout_us = exchange_->line_quiet_us + patience_us_;
  return true;
}

bool Master::send_due_poll(std::int64_t now_us) {
  bool due = false;
  for (Mcu& mcu : mcus_) {
    if (mcu.view.phase == McuPhase::kOffline || mcu.poll_due_us > now_us) continue;
    mcu.poll_now = due = true;
  }
  return due && send_wanted_poll(now_us);
}

}  // namespace bushd::link
