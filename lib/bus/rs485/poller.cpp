#include "bus/rs485/poller.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "bus/bus_times.h"

namespace bushd::link {
namespace {

using fieldbus::kFirstWindowUs;
using fieldbus::kPollPeriodUs;

// Nothing else is sent meanwhile; queues that have run low must not wait for longer.
constexpr std::int64_t kMaxCycleUs = 60'000;
// While nothing moves, answers to a routine poll take no more than this, or so many times what each
// poll takes besides: a start does not wait for all MCUs.
constexpr std::int64_t kAnswersAtRestUs = 5'000;
constexpr std::int64_t kShareAtRest = 2;
constexpr std::int64_t kUnitUs = BUSHD_REPLY_UNIT_NS / 1000;
constexpr std::int64_t kPollAgainUs = kPollPeriodUs * 2 / 5;
// Turns begin at multiples of this, so that many buses have theirs at once, and one wake of the
// program serves them all.
constexpr std::int64_t kTurnUs = 5'000;
// Each repetition to an MCU that has not answered is later by one part of so many of its longest
// answer (spread_us).
constexpr std::int64_t kSpread = 6;
constexpr std::int64_t kExtraShare = 2;  // extra polls take one part of so many
// A poll of one MCU takes about as long. Who has news by then is waited for: asked apart it would
// have to wait until that poll is over, and for as long again.
constexpr std::int64_t kNewsTogetherUs = 3'000;
constexpr int kMaxMissedReplies = 10;  // about half a second
// So many reports, 10 s, have room for inputs or counters after one that had some.
constexpr int kLivelyReports = 200;
// An MCU that was not asked for so long may have given the number to another report.
constexpr std::int64_t kKnownForUs = 1'000'000;

}  // namespace

Poller::Poller(PerMcu<McuRecord>& mcus, Transactions& transactions, const FrameWriter& writer)
    : mcus_(mcus), transactions_(transactions), writer_(writer), polled_(mcus.size()) {}

// Those that have news or whose turn comes soon are asked along, and all if one may miss its reply:
// somebody must answer after it.
std::vector<McuIndex> Poller::choose(std::int64_t now_us) const {
  const std::int64_t arrives_us = arrival_us(now_us);
  bool doubtful = false;
  for (const McuIndex i : mcus_.indices()) {
    doubtful |= asked_for(i) && polled_[i].missed_replies != 0;
  }
  std::vector<McuIndex> asked;
  for (const McuIndex i : mcus_.indices()) {
    // One that will have news soon is asked then, not before and then again.
    const bool has_news = polled_[i].news_us <= arrives_us;
    const bool waits = polled_[i].news_us < polled_[i].routine_us && !has_news;
    const bool soon =
        doubtful || has_news || (polled_[i].routine_us <= now_us + kPollPeriodUs / 2 && !waits);
    const bool along = mcus_[i].view.phase != McuPhase::kOffline && soon;
    if (asked_for(i) || along) asked.push_back(i);
  }
  std::stable_sort(asked.begin(), asked.end(), [this](McuIndex a, McuIndex b) {
    const auto rank = [this](McuIndex i) {
      return std::tuple{polled_[i].missed_replies == 0, !asked_for(i), polled_[i].routine_us};
    };
    return rank(a) < rank(b);
  });
  return asked;
}

void Poller::forget_old(std::int64_t now_us) {
  for (const McuIndex i : mcus_.indices()) {
    if (now_us - polled_[i].reported_us >= kKnownForUs) mcus_[i].known = 0;
  }
}

std::int64_t Poller::news_due_us(McuIndex mcu) const {
  const std::int64_t news_us = polled_[mcu].news_us;
  if (news_us == INT64_MAX) return INT64_MAX;
  std::int64_t last_us = news_us;
  std::size_t together = 0;
  for (const Polled& other : polled_) {
    if (other.news_us > news_us + kNewsTogetherUs) continue;
    last_us = std::max(last_us, other.news_us);
    ++together;
  }
  return std::max(last_us - poll_frame_us(together), extra_from_us_);
}

// How long the frame is under way at least: an MCU reports of the time when it has arrived.
std::int64_t Poller::poll_frame_us(std::size_t entries) const {
  return std::min(writer_.line_us(2 + entries * BUSHD_POLL_ENTRY + BUSHD_FRAME_OVERHEAD),
                  kNewsTogetherUs);
}

// When one arrives that is sent now, and asks all that have news soon.
std::int64_t Poller::arrival_us(std::int64_t now_us) const {
  const auto soon = std::ranges::count_if(polled_, [now_us](const Polled& polled) {
    return polled.news_us <= now_us + kNewsTogetherUs;
  });
  return now_us + poll_frame_us(static_cast<std::size_t>(soon));
}

// A poll that has begun shortly before there is news would keep it waiting: it begins so much
// sooner that it is over by then.
std::int64_t Poller::routine_due_us(McuIndex mcu) const {
  const std::int64_t routine_us = polled_[mcu].routine_us;
  const bool clear = routine_us >= first_news_us_ || routine_us < first_news_us_ - kMaxCycleUs;
  if (clear) return routine_us;
  const std::int64_t latency_us = transactions_.health().latency.recent_us;
  const std::int64_t cycle_us = expected_cycle_us({}) + latency_us;
  return std::min(routine_us, first_news_us_ - cycle_us);
}

std::int64_t Poller::due_us(McuIndex mcu) const {
  return std::min(routine_due_us(mcu), news_due_us(mcu));
}

void Poller::expect_news(McuIndex mcu, std::int64_t at_us) {
  polled_[mcu].news_us = at_us;
  first_news_us_ = std::ranges::min(polled_, {}, &Polled::news_us).news_us;
}

// Payload bytes of its report: for all, where all may be told. Otherwise for what is likely: the
// last SYNC until that is told, as much as inputs or counters take if there were some lately, and
// motors that plans move. Of motors that rest by then it has no more than where they stand.
std::uint8_t Poller::room(McuIndex mcu, std::uint16_t to_move, bool rests) const {
  const McuRecord& record = mcus_[mcu];
  const Polled& polled = polled_[mcu];
  const bushd_report& report = record.view.report;
  const auto of_mcu = static_cast<std::uint16_t>((1u << record.view.identity.motors) - 1u);
  const bool all = record.view.phase != McuPhase::kOnline || record.known == 0 ||
                   polled.missed_replies != 0 || polled.has_more;
  if (all) return static_cast<std::uint8_t>(bushd_report_size(BUSHD_TELLS_ALL, of_mcu));
  if (record.answered || (report.autonomous | report.armed) != 0) {
    return static_cast<std::uint8_t>(bushd_report_size(BUSHD_NEWS_IN_MOTION, of_mcu));
  }
  const auto motors = static_cast<std::uint16_t>(polled.motors | report.moving | to_move);
  unsigned sections = 0;
  if (record.sync_sent) {
    sections |= BUSHD_TELLS_SYNC;
  } else if (polled.lively_reports != 0) {
    sections |= BUSHD_TELLS_INPUTS;
  }
  if (motors != 0 && !rests) sections |= BUSHD_TELLS_MOTION;
  return static_cast<std::uint8_t>(bushd_report_size(static_cast<std::uint8_t>(sections), motors));
}

std::int64_t Poller::reply_us(std::size_t payload) const {
  return writer_.line_us(payload + BUSHD_FRAME_OVERHEAD + 1);
}

std::int64_t Poller::longest_cycle_us() const {
  const std::int64_t guard_us = writer_.window_guard_us();
  std::int64_t answers_us = 0;
  std::size_t entries = 0;
  for (const McuRecord& mcu : mcus_) {
    if (mcu.view.phase == McuPhase::kOffline) continue;
    ++entries;
    const std::int64_t with_us =
        answers_us + reply_us(BUSHD_REPORT_SIZE(mcu.view.identity.motors)) + guard_us;
    if (answers_us == 0 || with_us <= kMaxCycleUs) answers_us = with_us;
  }
  return writer_.line_us(2 + entries * BUSHD_POLL_ENTRY + BUSHD_FRAME_OVERHEAD) + kFirstWindowUs +
         answers_us;
}

std::int64_t Poller::expected_cycle_us(std::span<const ToBegin> together) const {
  std::int64_t answers_us = 0;
  std::size_t entries = 0;
  for (const McuIndex i : mcus_.indices()) {
    if (mcus_[i].view.phase == McuPhase::kOffline) continue;
    std::uint16_t to_move = 0;
    for (const ToBegin& begin : together) {
      if (begin.mcu == i) to_move |= begin.motors;
    }
    ++entries;
    answers_us += reply_us(room(i, to_move, false)) + writer_.window_guard_us();
  }
  return writer_.line_us(2 + entries * BUSHD_POLL_ENTRY + BUSHD_FRAME_OVERHEAD) + kFirstWindowUs +
         std::min(answers_us, kMaxCycleUs);
}

// Where something moves, or has news, or an MCU is not known well, all are asked by one poll.
std::int64_t Poller::most_cycle_us(std::int64_t now_us) const {
  const std::int64_t arrives_us = arrival_us(now_us);
  for (const McuIndex i : mcus_.indices()) {
    const McuRecord& mcu = mcus_[i];
    const Polled& polled = polled_[i];
    if (mcu.view.phase == McuPhase::kOffline) continue;
    const bool rests = polled.motors == 0 && polled.news_us > arrives_us;
    const bool known = mcu.view.phase == McuPhase::kOnline && mcu.known != 0;
    if (!rests || !known || mcu.poll_wanted || polled.missed_replies != 0) return kMaxCycleUs;
  }
  const std::int64_t besides_us = kFirstWindowUs + transactions_.health().latency.recent_us;
  return kFirstWindowUs + std::max(kAnswersAtRestUs, kShareAtRest * besides_us);
}

bool Poller::send_wanted(std::int64_t now_us) {
  const auto wanted = [](const McuRecord& mcu) { return mcu.poll_wanted; };
  return std::ranges::any_of(mcus_, wanted) && send(now_us);
}

bool Poller::send(std::int64_t now_us) {
  forget_old(now_us);
  const std::int64_t most_us = most_cycle_us(now_us);
  std::vector<bushd_poll_entry> entries;
  std::vector<Transactions::ReplyWindow> windows;
  const std::int64_t guard_us = writer_.window_guard_us();
  const std::int64_t arrives_us = arrival_us(now_us);
  std::int64_t begin_us = kFirstWindowUs;
  for (const McuIndex i : choose(now_us)) {
    const McuRecord& mcu = mcus_[i];
    const std::uint8_t most = room(i, 0, polled_[i].rest_us <= arrives_us);
    const std::int64_t end_us = begin_us + reply_us(most);
    const bool full = entries.size() == BUSHD_POLL_MAX_ENTRIES || end_us > most_us;
    if (full && !entries.empty()) break;
    const auto units = static_cast<std::uint16_t>((begin_us + kUnitUs - 1) / kUnitUs);
    entries.push_back({mcu.setup.address.value, units, mcu.known, most});
    windows.push_back({.mcu = i, .address = mcu.setup.address, .end_us = end_us, .payload = most});
    begin_us = end_us + guard_us;
  }
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
  const std::size_t size =
      bushd_encode_poll(entries.data(), static_cast<std::uint8_t>(entries.size()), payload.data());
  transactions_.ask_all(now_us, BUSHD_MSG_POLL, {payload.data(), size}, windows, guard_us);
  extra_sent_us_.reset();
  bool extra = false;
  for (const Transactions::ReplyWindow& window : windows) {
    mcus_[window.mcu].poll_wanted = false;
    Polled& polled = polled_[window.mcu];
    polled.due = false;
    polled.routine_us = (now_us + kPollPeriodUs) / kTurnUs * kTurnUs;
    if (polled.news_us > arrives_us) continue;
    expect_news(window.mcu, INT64_MAX);
    extra = true;
  }
  if (extra) {
    const std::int64_t took_us = writer_.line_us(size + BUSHD_FRAME_OVERHEAD + 1) +
                                 windows.back().end_us + transactions_.patience_us();
    extra_from_us_ = now_us + kExtraShare * took_us;
    extra_sent_us_ = now_us;
  }
  return true;
}

bool Poller::send_due(std::int64_t now_us) {
  bool due = false;
  for (const McuIndex i : mcus_.indices()) {
    if (mcus_[i].view.phase == McuPhase::kOffline || due_us(i) > now_us) continue;
    polled_[i].due = due = true;
  }
  return due && send(now_us);
}

// Mostly all have answered, so that it took less than was set aside for it.
void Poller::ended(std::int64_t now_us) {
  if (!extra_sent_us_) return;
  const std::int64_t took_us = now_us - *std::exchange(extra_sent_us_, std::nullopt);
  extra_from_us_ = std::min(extra_from_us_, now_us + (kExtraShare - 1) * took_us);
}

// Noise with a period, as a drive makes it, would meet each answer if those came with a period,
// too. So each is asked for later than the one before, by a part of what it takes to tell all:
// where bursts are 1.8 to 10 times as far apart as that, one of ten answers comes between two,
// whatever their phase.
std::int64_t Poller::spread_us(McuIndex mcu) const {
  const std::int64_t all_us = reply_us(BUSHD_REPORT_SIZE(mcus_[mcu].view.identity.motors));
  return all_us * polled_[mcu].missed_replies / kSpread;
}

bool Poller::missed(std::int64_t now_us, McuIndex mcu, std::uint8_t type) {
  ++mcus_[mcu].health.timeouts;
  Polled& polled = polled_[mcu];
  if (++polled.missed_replies >= kMaxMissedReplies) return true;
  // Sooner than usual; but a dead MCU must not starve the others.
  if (type == BUSHD_MSG_POLL) polled.routine_us = now_us + kPollAgainUs + spread_us(mcu);
  return false;
}

void Poller::follow_report(std::int64_t now_us, McuIndex mcu) {
  polled_[mcu].reported_us = now_us;
  polled_[mcu].has_more = false;
  const bushd_report& report = mcus_[mcu].view.report;
  constexpr unsigned kEvents = BUSHD_TELLS_INPUTS | BUSHD_TELLS_COUNTERS;
  const bool events = (report.sections & kEvents) != 0 && !bushd_report_is_whole(&report);
  int& lively = polled_[mcu].lively_reports;
  lively = events ? kLivelyReports : std::max(lively - 1, 0);
  polled_[mcu].counters.follow(report, mcus_[mcu].health);
}

bool Poller::no_room(McuIndex mcu) {
  if (std::exchange(polled_[mcu].has_more, true)) return false;
  mcus_[mcu].poll_wanted = true;
  return true;
}

void Poller::went_offline(McuIndex mcu) {
  polled_[mcu].missed_replies = 0;
  polled_[mcu].has_more = polled_[mcu].due = false;
  expect_motion(mcu, 0, INT64_MAX);
  mcus_[mcu].known = 0;
  expect_news(mcu, INT64_MAX);
  mcus_[mcu].poll_wanted = mcus_[mcu].answered = false;
}

}  // namespace bushd::link
