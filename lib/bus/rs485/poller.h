// Polls: one request for the reports of many MCUs, each in a window of its own, so that the
// adapter's latency is paid once. Whoever missed its last reply answers first: if it misses this
// one too, the one after it ends the waiting.
#pragma once

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
  // Its report has something new at this time, so its turn comes then, sooner or a little later
  // than it would otherwise. Polls asked for so leave three quarters of the line to others.
  void ask_at(McuIndex mcu, std::int64_t at_us);
  // When the MCU's turn comes. Precondition: it is not offline.
  std::int64_t due_us(McuIndex mcu) const { return polled_[mcu].due_us; }

  // An answer to whatever request.
  void answered(McuIndex mcu) { polled_[mcu].missed_replies = 0; }
  // Or none. Returns true if the MCU has missed so many replies that it is taken for lost.
  bool missed(std::int64_t now_us, McuIndex mcu, std::uint8_t type);
  // The MCU's record has a new report: what has become of its counters.
  void follow_report(McuIndex mcu);
  void went_offline(McuIndex mcu);

 private:
  struct Polled {
    std::int64_t due_us = 0;
    std::int64_t asked_us = 0;  // last
    int missed_replies = 0;     // requests in a row without an answer
    ReportedCounters counters;
  };

  std::vector<McuIndex> choose(std::int64_t now_us) const;
  std::int64_t reply_us(const McuRecord& mcu) const;

  PerMcu<McuRecord>& mcus_;
  Transactions& transactions_;
  const FrameWriter& writer_;
  PerMcu<Polled> polled_;
};

}  // namespace bushd::link
