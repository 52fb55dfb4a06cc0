// Time synchronisation: when the next SYNC is due and what it says of the one before, and the
// master's own idea of bus time (docs/design.md).
//
// A SYNC is heard by all at once, but not by an MCU that a disturbance hit, and that one may hear a
// repetition of the frame instead: it knows another instant by that sync_id. If its time were
// passed on, the others would be put out of step with the bus. So an answer counts only if all MCUs
// that are in step agree about the SYNC, and have been asked since. If they disagree about the next
// one too, it is their clocks and not the SYNC; then the first one's time is that of the bus, of
// those that have moves if there are any.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>

#include "bus/bus_times.h"
#include "bus/rs485/bus_clock.h"
#include "bus/rs485/bus_setup.h"
#include "bus/rs485/frame_writer.h"
#include "bus/rs485/mcu_record.h"
#include "engine/message.h"

namespace bushd::link {

class Synchroniser {
 public:
  // A master says SYNC at least as often, two of them in a row may be lost: one that is silent for
  // longer is not there any more, and another one may have taken its place.
  static constexpr std::int64_t kOtherMasterUs = 3 * fieldbus::kSyncPeriodUs;

  // All of them outlive it.
  Synchroniser(const BusSetup& setup, PerMcu<McuRecord>& mcus, FrameWriter& writer);

  const BusClock& clock() const { return clock_; }

  void port_opened(std::int64_t now_us) { due_us_ = now_us; }
  void port_lost() { clock_.reset(); }
  // An MCU has been found that may have to be told the time.
  void hurry(std::int64_t now_us) { due_us_ = std::min(due_us_, now_us); }

  // MCUs that make the run of a line go by the time that SYNCs tell: they get more of them.
  void lines_run(bool any);

  // A frame that is not an answer.
  void overheard(std::int64_t now_us, const bushd_frame& frame);
  // Another master was heard on this line within the last seconds, by this one or by an MCU.
  bool two_masters(std::int64_t now_us) const;
  // An MCU has heard another one before this one, so lately that it may still be there: it has said
  // SYNC when this one was not there to hear it.
  bool perhaps_another(std::int64_t now_us) const { return now_us < perhaps_another_until_us_; }

  enum class Agreement {
    kInStep,    // the clock has been set by it
    kUnsynced,  // the MCU does not know bus time, or its report is too old
    kOtherTime  // it counts other ticks than the others
  };
  // Until told otherwise the MCU may count ticks of its own, though it says that it is in step:
  // only when it has heard the last SYNC at the time at which others have is it taken for that.
  void expect_own_time(McuIndex mcu, bool may) { since_sync_[mcu].own_time = may; }
  // The MCU's record has a new report; its `tick` is set here. `line_us`: from the instant that the
  // report tells of to its last byte, if only the line takes time.
  Agreement follow_report(std::int64_t now_us, McuIndex mcu, std::int64_t line_us, bool in_time);

  std::int64_t due_us() const { return due_us_; }
  bool send_due(std::int64_t now_us);

 private:
  // What MCUs' reports say of the last SYNC.
  struct Survey {
    bool listening = false;  // somebody would hear a SYNC
    bool all_heard = true;   // of those, each has reported
    bool waiting = false;    // an MCU does not know the time yet
    bool anybody = false;    // an MCU knows it
    bool all_asked = true;   // all who know it have reported since that SYNC
    bool agreed = true;      // and agree when it was
    const bushd_report* reference = nullptr;
  };

  std::int64_t difference_ns(const bushd_report& a, const bushd_report& b) const;
  Survey survey() const;
  void survey_mcu(McuIndex mcu, Survey& survey) const;
  void note_other_master(std::int64_t now_us, const bushd_report& report);
  void note_offsets(const bushd_report* reference);
  bool anybody_online() const;
  bool agrees(McuIndex mcu) const;

  const BusSetup& setup_;
  PerMcu<McuRecord>& mcus_;
  FrameWriter& writer_;
  BusClock clock_;
  std::int64_t due_us_ = 0;
  std::int64_t sent_us_ = 0;  // the last one
  bool lines_run_ = false;
  std::optional<std::uint32_t> sync_id_;  // of the last SYNC sent
  bool disagreed_ = false;                // MCUs, about the SYNC before
  struct Mcu {
    bool reported = false;  // since the last SYNC
    bool own_time = false;  // expect_own_time
  };
  PerMcu<Mcu> since_sync_;
  std::optional<std::int64_t> other_master_until_us_;  // since it was heard
  std::int64_t perhaps_another_until_us_ = INT64_MIN;
  // The last SYNCs sent, oldest first: as many as there are while one of them may tell of another
  // master.
  std::deque<std::uint32_t> own_sync_ids_;
};

}  // namespace bushd::link
