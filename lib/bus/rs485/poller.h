// Polls: one request for the reports of many MCUs, each in a window of its own, so that the
// adapter's latency is paid once. Whoever missed its last reply answers first: if it misses this
// one too, the one after it ends the waiting.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "bus/rs485/mcu_record.h"
#include "bus/rs485/transactions.h"
#include "engine/message.h"

namespace bushd::link {

class Poller {
 public:
  // All of them outlive it.
  Poller(PerMcu<McuRecord>& mcus, Transactions& transactions, const FrameWriter& writer);

  // Asks those whose report is wanted (McuRecord::poll_wanted), if there are any.
  bool send_wanted(std::int64_t now_us);
  // The same, and those whose turn has come.
  bool send_due(std::int64_t now_us);
  // How long the line is taken by a poll of all MCUs that are not offline, its answers included.
  std::int64_t cycle_us() const;
  // At this time the MCU's report will have something new: it is asked then, unless its turn comes
  // before. INT64_MAX: nothing is expected. Such extra polls take at most half of the time, so
  // they may come later; no routine poll does.
  void expect_news(McuIndex mcu, std::int64_t at_us) { polled_[mcu].news_us = at_us; }
  // When the MCU's turn comes. Precondition: it is not offline.
  std::int64_t due_us(McuIndex mcu) const {
    const Polled& polled = polled_[mcu];
    return std::min(polled.routine_us, std::max(polled.news_us, extra_from_us_));
  }

  // An answer to whatever request.
  void answered(McuIndex mcu) { polled_[mcu].missed_replies = 0; }
  // Or none. Returns true if the MCU has missed so many replies that it is taken for lost.
  bool missed(std::int64_t now_us, McuIndex mcu, std::uint8_t type);
  // The MCU's record has a new report: what has become of its counters.
  void follow_report(McuIndex mcu);
  void went_offline(McuIndex mcu);

 private:
  struct Polled {
    std::int64_t routine_us = 0;       // its turn
    std::int64_t news_us = INT64_MAX;  // expect_news
    int missed_replies = 0;            // requests in a row without an answer
    ReportedCounters counters;
  };

  std::vector<McuIndex> choose(std::int64_t now_us) const;
  std::int64_t reply_us(const McuRecord& mcu) const;

  PerMcu<McuRecord>& mcus_;
  Transactions& transactions_;
  const FrameWriter& writer_;
  PerMcu<Polled> polled_;
  std::int64_t extra_from_us_ = 0;  // no extra poll before
};

}  // namespace bushd::link
