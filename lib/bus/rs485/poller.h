// Polls: one request for the reports of many MCUs, each in a window of its own, so that the
// adapter's latency is paid once. Whoever missed its last reply answers first: if it misses this
// one too, the one after it ends the waiting.
//
// A window is as long as what is to be told is likely to need. A report with more news says so, and
// is asked for again.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bus/rs485/common_start.h"
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
  // Asks these, and those whose turn has come.
  bool send_due(std::int64_t now_us);
  // How long the line is taken by a poll of all MCUs that are not offline, its answers included.
  std::int64_t longest_cycle_us() const;
  // By one now, if what is likely is told, and these motors are to move.
  std::int64_t expected_cycle_us(std::span<const ToBegin> together) const;
  // At this time the MCU's report will have something new, and the poll that asks it arrives then.
  // INT64_MAX: nothing is expected. MCUs that have news at nearly the same time are asked by one
  // poll. Such extra polls take at most half of the time, so they may come later; no routine poll
  // does.
  void expect_news(McuIndex mcu, std::int64_t at_us);
  // Until told otherwise these motors of it move, or are to. By plan all of them rest from
  // `rest_us` on, INT64_MAX: none knows when.
  void expect_motion(McuIndex mcu, std::uint16_t motors, std::int64_t rest_us) {
    polled_[mcu].motors = motors;
    polled_[mcu].rest_us = rest_us;
  }
  // When the MCU's turn comes. Precondition: it is not offline.
  std::int64_t due_us(McuIndex mcu) const;

  // An answer to whatever request.
  void answered(McuIndex mcu) { polled_[mcu].missed_replies = 0; }
  // The poll is over.
  void ended(std::int64_t now_us);
  // Or none. Returns true if the MCU has missed so many replies that it is taken for lost.
  bool missed(std::int64_t now_us, McuIndex mcu, std::uint8_t type);
  // What the MCU's record has of reports was of this time, or is void.
  void follow_report(std::int64_t now_us, McuIndex mcu);
  // What is new found no room: it is asked again, and gets room for all. False: it had that.
  bool no_room(McuIndex mcu);
  void went_offline(McuIndex mcu);

 private:
  struct Polled {
    std::int64_t routine_us = 0;       // its turn
    std::int64_t news_us = INT64_MAX;  // expect_news
    int missed_replies = 0;            // requests in a row without an answer
    std::int64_t reported_us = 0;      // the last report
    std::uint16_t motors = 0;          // expect_motion
    std::int64_t rest_us = INT64_MAX;
    bool has_more = false;   // no_room
    bool due = false;        // its turn has come
    int lively_reports = 0;  // so many may have inputs or counters, as one had lately
    ReportedCounters counters;
  };

  bool asked_for(McuIndex mcu) const { return mcus_[mcu].poll_wanted || polled_[mcu].due; }
  std::vector<McuIndex> choose(std::int64_t now_us) const;
  bool send(std::int64_t now_us);
  std::int64_t most_cycle_us(std::int64_t now_us) const;
  void forget_old(std::int64_t now_us);
  std::int64_t news_due_us(McuIndex mcu) const;
  std::int64_t poll_frame_us(std::size_t entries) const;
  std::int64_t arrival_us(std::int64_t now_us) const;
  std::int64_t routine_due_us(McuIndex mcu) const;
  std::uint8_t room(McuIndex mcu, std::uint16_t to_move, bool rests) const;
  std::int64_t reply_us(std::size_t payload) const;
  std::int64_t spread_us(McuIndex mcu) const;

  PerMcu<McuRecord>& mcus_;
  Transactions& transactions_;
  const FrameWriter& writer_;
  PerMcu<Polled> polled_;
  std::int64_t first_news_us_ = INT64_MAX;
  std::int64_t extra_from_us_ = 0;             // no extra poll before
  std::optional<std::int64_t> extra_sent_us_;  // that of the poll under way, if it is an extra one
};

}  // namespace bushd::link
