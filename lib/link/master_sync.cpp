// Time marks: when the next SYNC is due and what it says of the mark before.
//
// A mark is heard by all at once, but not by an MCU that a disturbance hit, and that one may hear a
// repetition of the frame instead: its mark of that name is another one. If its time were passed
// on, the others would be put out of step with the bus. So an answer counts only if all MCUs that
// are in step agree about the mark, and have been asked since. If they disagree about the next mark
// too, it is their clocks and not the mark; then the first one's time is that of the bus, of those
// that have moves if there are any.
#include <cstdlib>

#include "link/master.h"
#include "link/master_limits.h"

namespace bushd::link {
namespace {

constexpr std::int64_t kFirstSyncPeriodUs = 60'000;  // while an MCU waits to be told the time
// A SYNC frame lasts longer on most lines, so its repetition is told apart. Crystals that are 100
// ppm apart need a second without a mark for it, those whose rate is known much longer.
constexpr std::int64_t kAgreementNs = 100'000;

}  // namespace

// When two MCUs heard the same mark, a minus b.
std::int64_t Master::mark_difference_ns(const bushd_report& a, const bushd_report& b) const {
  const auto ticks = static_cast<std::int32_t>(a.mark_tick - b.mark_tick);
  return std::int64_t{ticks} * setup_.tick_ns + a.mark_ns - b.mark_ns;
}

Master::MarkSurvey Master::survey_marks() const {
  MarkSurvey survey;
  for (const McuPhase phase : {McuPhase::kOnline, McuPhase::kConnecting}) {
    for (const Mcu& mcu : mcus_) {
      if (mcu.view.phase == phase) survey_mark(mcu, survey);
    }
  }
  return survey;
}

void Master::survey_mark(const Mcu& mcu, MarkSurvey& survey) const {
  survey.listening = true;
  survey.all_heard &= mcu.view.reported;
  if (!mcu.view.reported) return;
  const bushd_report& report = mcu.view.report;
  const bool synced = (report.flags & BUSHD_FLAG_SYNCED) != 0;
  const bool marked = (report.flags & BUSHD_FLAG_MARK) != 0;
  survey.anybody |= synced;
  survey.waiting |= !synced || !marked;
  if (!synced) return;
  survey.all_asked &= mcu.asked_since_mark;
  if (!marked || mark_ != report.mark || report.mark_ns >= setup_.tick_ns) return;
  if (survey.reference == nullptr) {
    survey.reference = &report;
  } else if (std::abs(mark_difference_ns(report, *survey.reference)) > kAgreementNs) {
    survey.agreed = false;
  }
}

void Master::note_offsets(const bushd_report* reference) {
  if (reference == nullptr) return;
  for (Mcu& mcu : mcus_) {
    const bushd_report& report = mcu.view.report;
    const bool comparable = mcu.view.reported && (report.flags & BUSHD_FLAG_MARK) != 0 &&
                            report.mark == reference->mark;
    if (!comparable) continue;
    mcu.health.clock_offset_us = static_cast<double>(mark_difference_ns(report, *reference)) * 1e-3;
  }
}

bool Master::send_due_sync(std::int64_t now_us) {
  if (now_us < sync_due_us_) return false;
  const MarkSurvey survey = survey_marks();
  note_offsets(survey.reference);
  const bool doubtful = !survey.agreed && !disagreed_;
  const bool soon = survey.waiting || doubtful;
  sync_due_us_ = now_us + (soon ? kFirstSyncPeriodUs : kSyncPeriodUs);
  if (!survey.listening) return false;
  // By the clock, so that no two marks of a master have the same name.
  const auto name = static_cast<std::uint32_t>(now_us / 1000);
  bushd_sync sync{};
  sync.master = setup_.master;
  sync.mark = mark_ == name ? name + 1 : name;
  if (mark_) sync.known_mark = *mark_;
  if (survey.reference != nullptr && survey.all_asked && !doubtful) {
    sync.follows = true;
    sync.mark_tick = survey.reference->mark_tick;
    sync.mark_ns = survey.reference->mark_ns;
  } else if (survey.all_heard && !survey.anybody && mark_) {
    // Nobody on the bus knows the time: it begins at the mark before.
    sync.follows = true;
    clock_.reset();
  }
  disagreed_ = doubtful;
  std::array<std::uint8_t, 24> payload;
  const std::size_t size = bushd_encode_sync(&sync, payload.data());
  writer_.send(now_us, kBroadcast, BUSHD_MSG_SYNC, {payload.data(), size});
  mark_ = sync.mark;
  for (Mcu& mcu : mcus_) {
    mcu.asked_since_mark = false;
    // MCUs that wait are asked at once, so that the next mark can follow this one.
    if (survey.waiting && mcu.view.phase == McuPhase::kConnecting) mcu.poll_wanted = true;
  }
  return true;
}

}  // namespace bushd::link
