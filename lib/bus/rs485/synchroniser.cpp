#include "bus/rs485/synchroniser.h"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace bushd::link {
namespace {

using fieldbus::kSyncPeriodUs;

constexpr std::int64_t kFirstSyncPeriodUs = 60'000;  // while an MCU waits to be told the time
// A SYNC tells the time of the one before. Of the second that MCUs run on for, some may be lost.
constexpr std::int64_t kLineSyncPeriodUs = 200'000;
// A SYNC frame lasts longer on most lines, so its repetition is told apart. Crystals that are 100
// ppm apart need a second without a SYNC for it, those whose rate is known much longer.
constexpr std::int64_t kAgreementNs = 100'000;
constexpr std::int64_t kClockJumpUs = 400'000;  // more than any latency: it is another time
constexpr std::size_t kOwnSyncsKept = 2 * Synchroniser::kOtherMasterUs / kFirstSyncPeriodUs;

}  // namespace

Synchroniser::Synchroniser(const BusSetup& setup, PerMcu<McuRecord>& mcus, FrameWriter& writer)
    : setup_(setup),
      mcus_(mcus),
      writer_(writer),
      clock_(setup.tick_ns),
      since_sync_(mcus.size()) {}

void Synchroniser::lines_run(bool any) {
  lines_run_ = any;
  if (any) due_us_ = std::min(due_us_, sent_us_ + kLineSyncPeriodUs);
}

void Synchroniser::overheard(std::int64_t now_us, const bushd_frame& frame) {
  if (!writer_.has_sent(frame)) other_master_until_us_ = now_us + kOtherMasterUs;
}

bool Synchroniser::two_masters(std::int64_t now_us) const {
  if (other_master_until_us_ && now_us < *other_master_until_us_) return true;
  return std::any_of(mcus_.begin(), mcus_.end(), [](const McuRecord& mcu) {
    return mcu.view.phase != McuPhase::kOffline && mcu.view.reported &&
           (mcu.view.report.flags & BUSHD_FLAG_TWO_MASTERS) != 0;
  });
}

// Also by a SYNC from before this master was there: the last one that the MCU has heard.
void Synchroniser::note_other_master(std::int64_t now_us, const bushd_report& report) {
  if ((report.flags & BUSHD_FLAG_SYNC_HEARD) == 0) return;
  if (std::ranges::find(own_sync_ids_, report.sync_id) != own_sync_ids_.end()) return;
  const auto age_ticks = static_cast<std::int32_t>(report.tick - report.sync_tick);
  const std::int64_t age_us = age_ticks * setup_.tick_ns / 1000;
  perhaps_another_until_us_ = std::max(perhaps_another_until_us_,
                                       now_us - std::max<std::int64_t>(age_us, 0) + kOtherMasterUs);
}

bool Synchroniser::anybody_online() const {
  return std::any_of(mcus_.begin(), mcus_.end(),
                     [](const McuRecord& mcu) { return mcu.view.phase == McuPhase::kOnline; });
}

Synchroniser::Agreement Synchroniser::follow_report(std::int64_t now_us, McuIndex mcu,
                                                    std::int64_t line_us, bool in_time) {
  McuView& view = mcus_[mcu].view;
  const bushd_report& report = view.report;
  since_sync_[mcu].reported = true;
  if (sync_id_ == report.sync_id) mcus_[mcu].sync_sent = false;
  note_other_master(now_us, report);
  view.tick = clock_.unwrap(report.tick, now_us);
  constexpr std::uint8_t kKnowsTime = BUSHD_FLAG_SYNCED | BUSHD_FLAG_SYNC_HEARD;
  if (!in_time || (report.flags & kKnowsTime) != kKnowsTime) return Agreement::kUnsynced;
  if (since_sync_[mcu].own_time && !agrees(mcu)) return Agreement::kUnsynced;
  if (clock_.valid() &&
      std::abs(view.tick - clock_.tick_at(now_us)) > clock_.ticks_in(kClockJumpUs)) {
    if (anybody_online()) return Agreement::kOtherTime;
    // Nobody has moves in the time before.
    clock_.reset();
    view.tick = clock_.unwrap(report.tick, now_us);
  }
  clock_.sample(view.tick, report.tick_ns + line_us * 1000, now_us);
  return Agreement::kInStep;
}

// When two MCUs heard the same SYNC, a minus b.
std::int64_t Synchroniser::difference_ns(const bushd_report& a, const bushd_report& b) const {
  const auto ticks = static_cast<std::int32_t>(a.sync_tick - b.sync_tick);
  return std::int64_t{ticks} * setup_.tick_ns + a.sync_ns - b.sync_ns;
}

Synchroniser::Survey Synchroniser::survey() const {
  Survey survey;
  for (const McuPhase phase : {McuPhase::kOnline, McuPhase::kConnecting}) {
    for (const McuIndex i : mcus_.indices()) {
      if (mcus_[i].view.phase == phase) survey_mcu(i, survey);
    }
  }
  return survey;
}

void Synchroniser::survey_mcu(McuIndex mcu, Survey& survey) const {
  const McuView& view = mcus_[mcu].view;
  survey.listening = true;
  survey.all_heard &= view.reported;
  if (!view.reported) return;
  const bushd_report& report = view.report;
  const bool synced = (report.flags & BUSHD_FLAG_SYNCED) != 0;
  const bool marked = (report.flags & BUSHD_FLAG_SYNC_HEARD) != 0;
  survey.anybody |= synced;
  survey.waiting |= !synced || !marked;
  if (!synced) return;
  survey.all_asked &= since_sync_[mcu].reported;
  if (!marked || sync_id_ != report.sync_id || report.sync_ns >= setup_.tick_ns) return;
  if (survey.reference == nullptr) {
    survey.reference = &report;
  } else if (std::abs(difference_ns(report, *survey.reference)) > kAgreementNs) {
    survey.agreed = false;
  }
}

// One that is off by more adopts the time of the bus, once its motors rest. All are waited for:
// who reports first is not therefore the one whose time counts.
bool Synchroniser::agrees(McuIndex mcu) const {
  const Survey found = survey();
  const bushd_report& report = mcus_[mcu].view.report;
  return found.all_heard && found.all_asked && found.reference != nullptr &&
         sync_id_ == report.sync_id &&
         std::abs(difference_ns(report, *found.reference)) <= setup_.tick_ns / 2;
}

void Synchroniser::note_offsets(const bushd_report* reference) {
  if (reference == nullptr) return;
  for (McuRecord& mcu : mcus_) {
    const bushd_report& report = mcu.view.report;
    const bool comparable = mcu.view.reported && (report.flags & BUSHD_FLAG_SYNC_HEARD) != 0 &&
                            report.sync_id == reference->sync_id;
    if (!comparable) continue;
    mcu.health.clock_offset_us = static_cast<double>(difference_ns(report, *reference)) * 1e-3;
  }
}

bool Synchroniser::send_due(std::int64_t now_us) {
  if (now_us < due_us_) return false;
  const Survey found = survey();
  note_offsets(found.reference);
  const bool doubtful = !found.agreed && !disagreed_;
  const bool soon = found.waiting || doubtful;
  const std::int64_t period_us = lines_run_ ? kLineSyncPeriodUs : kSyncPeriodUs;
  due_us_ = now_us + (soon ? kFirstSyncPeriodUs : period_us);
  sent_us_ = now_us;
  if (!found.listening) return false;
  // By the clock, so that no two SYNCs of a master have the same id.
  const auto id = static_cast<std::uint32_t>(now_us / 1000);
  bushd_sync sync{};
  sync.master = setup_.master;
  sync.sync_id = sync_id_ == id ? id + 1 : id;
  if (sync_id_) sync.follow_up_id = *sync_id_;  // the follow-up's
  if (found.reference != nullptr && found.all_asked && !doubtful) {
    sync.follows = true;
    sync.sync_tick = found.reference->sync_tick;
    sync.sync_ns = found.reference->sync_ns;
  } else if (found.all_heard && !found.anybody && sync_id_) {
    // Nobody on the bus knows the time: it begins at the SYNC before.
    sync.follows = true;
    clock_.reset();
  }
  disagreed_ = doubtful;
  std::array<std::uint8_t, 24> payload;
  const std::size_t size = bushd_encode_sync(&sync, payload.data());
  writer_.send(now_us, kBroadcast, BUSHD_MSG_SYNC, {payload.data(), size});
  sync_id_ = sync.sync_id;
  if (own_sync_ids_.size() == kOwnSyncsKept) own_sync_ids_.pop_front();
  own_sync_ids_.push_back(sync.sync_id);
  for (const McuIndex i : mcus_.indices()) {
    since_sync_[i].reported = false;
    mcus_[i].sync_sent = true;
    // MCUs that wait are asked at once, so that the next SYNC can follow this one.
    const bool connecting = mcus_[i].view.phase == McuPhase::kConnecting;
    if (found.waiting && connecting) mcus_[i].poll_wanted = true;
  }
  return true;
}

}  // namespace bushd::link
