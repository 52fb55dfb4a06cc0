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
  if (std::none_of(mcus_.begin(), mcus_.end(), [](const Mcu& mcu) { return mcu.poll_wanted; })) {
    return false;
  }
  const bool doubtful = std::any_of(mcus_.begin(), mcus_.end(), [](const Mcu& mcu) {
    return mcu.poll_wanted && mcu.silent != 0;
  });
  std::vector<McuIndex> asked;
  for (const McuIndex i : mcus_.indices()) {
    const Mcu& mcu = mcus_[i];
    // Those whose turn comes soon are asked along, and all if one may be silent: somebody must
    // answer after it.
    const bool soon = doubtful || mcu.poll_due_us <= now_us + kPollPeriodUs / 2;
    const bool along = mcu.view.phase != McuPhase::kOffline && soon;
    if (mcu.poll_wanted || along) asked.push_back(i);
  }
  std::stable_sort(asked.begin(), asked.end(), [this](McuIndex a, McuIndex b) {
    const auto rank = [this](McuIndex i) {
      return std::pair{mcus_[i].silent == 0, !mcus_[i].poll_wanted};
    };
    return rank(a) < rank(b);
  });
  std::vector<bushd_poll_entry> entries;
  std::vector<Transactions::ReplySlot> slots;
  std::int64_t begin_us = kFirstSlotUs;
  for (const McuIndex i : asked) {
    const Mcu& mcu = mcus_[i];
    const std::int64_t end_us =
        begin_us +
        writer_.line_us(BUSHD_REPORT_SIZE(mcu.view.identity.motors) + BUSHD_FRAME_OVERHEAD + 1);
    const bool full = entries.size() == BUSHD_POLL_MAX_ENTRIES || end_us > kMaxCycleUs;
    if (full && !entries.empty()) break;
    const auto units = static_cast<std::uint16_t>((begin_us + kUnitUs - 1) / kUnitUs);
    entries.push_back({mcu.setup.address.value, units});
    slots.push_back({.mcu = i, .address = mcu.setup.address, .end_us = end_us});
    begin_us = end_us + kSlotGuardUs;
  }
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  const std::size_t size =
      bushd_encode_poll(entries.data(), static_cast<std::uint8_t>(entries.size()), payload.data());
  transactions_.ask_all(now_us, BUSHD_MSG_POLL, {payload.data(), size}, slots, kSlotGuardUs);
  for (const Transactions::ReplySlot& slot : slots) {
    Mcu& mcu = mcus_[slot.mcu];
    mcu.poll_wanted = false;
    mcu.poll_due_us = now_us + kPollPeriodUs;
  }
  return true;
}

bool Master::send_due_poll(std::int64_t now_us) {
  bool due = false;
  for (Mcu& mcu : mcus_) {
    if (mcu.view.phase == McuPhase::kOffline || mcu.poll_due_us > now_us) continue;
    mcu.poll_wanted = due = true;
  }
  return due && send_wanted_poll(now_us);
}

}  // namespace bushd::link
