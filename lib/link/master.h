// The master of one bus as a machine without I/O: host time and received bytes go in, bytes to send
// and events come out. It finds and configures MCUs, keeps them in step, keeps their tick queues
// filled, repairs what was lost and asks for reports. What motors shall do it asks from a
// TickSource.
//
// Not thread-safe; all times are microseconds of one monotonic clock.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/message.h"
#include "link/bus_clock.h"
#include "link/bus_setup.h"
#include "link/event.h"
#include "link/health.h"
#include "link/mcu_index.h"
#include "link/mcu_record.h"
#include "link/tick_source.h"
#include "link/transactions.h"

namespace bushd::link {

class Master : private Transactions::Listener {
 public:
  Master(BusSetup setup, TickSource& source);

  void port_opened(std::int64_t now_us);
  void port_lost(std::int64_t now_us, const std::string& cause);

  void receive(std::int64_t now_us, std::span<const std::uint8_t> bytes);
  // Does what is due. The returned bytes are to be sent now; they stay valid until the next call.
  std::span<const std::uint8_t> step(std::int64_t now_us);
  // step() has nothing to do before this time, unless bytes arrive or a call below is made.
  std::int64_t next_wake_us() const;

  // Events since the last call.
  std::vector<Event> take_events();

  const McuView& view(McuIndex mcu) const { return mcus_[mcu].view; }
  std::size_t mcu_count() const { return mcus_.size(); }
  bool time_known() const { return clock_.valid(); }
  Tick tick_at(std::int64_t now_us) const { return clock_.tick_at(now_us); }
  // Earliest tick at which a move of this motor can start and all its first frames still arrive
  // well before.
  Tick earliest_start(std::int64_t now_us, McuIndex mcu, std::uint8_t motor) const;
  // Earliest tick from which a replacement can take effect.
  Tick earliest_replace(std::int64_t now_us) const;
  // Another master was heard on this line within the last seconds, by this one or by an MCU.
  bool two_masters(std::int64_t now_us) const;

  // From `start` on, until dropped, the source has ticks for this motor. Preconditions: the MCU is
  // online, the motor has a table, start >= earliest_start.
  void begin(McuIndex mcu, std::uint8_t motor, Tick start);
  // The same, but the MCU gets the whole move at once and runs it by the motor's table. `steps`
  // (either sign, not 0) are those of the source's run from `start` on. Precondition also: the MCU
  // can (can_run_tables).
  void begin_table_run(McuIndex mcu, std::uint8_t motor, Tick start, std::int32_t steps);
  bool can_run_tables(McuIndex mcu) const;
  // What would go out for moves of the motors that the source has ticks for, on a line that has
  // nothing else to do and loses nothing. Preconditions as of begin().
  struct Motion {
    McuIndex mcu;
    std::uint8_t motor;
    Tick start;
    std::optional<std::int32_t> run_steps;  // of a table run
  };
  struct Traffic {
    std::uint64_t frames = 0;
    std::uint64_t bytes = 0;
  };
  // Nothing beyond `max_frames`: making them all takes as long as in the moves themselves.
  std::optional<Traffic> rehearse(std::int64_t now_us, TickSource& source,
                                  std::span<const Motion> motions, std::uint64_t max_frames) const;
  // Moves of the MCU's motors, `steps` (either sign, not 0) each, that an edge at its trigger input
  // starts. What becomes of them its reports tell, from when they have the number returned here.
  // Preconditions: the MCU is online and can (can_trigger), the motors have tables and are at rest,
  // no others wait (McuView::report.armed).
  struct Armed {
    std::uint8_t motor;
    std::int32_t steps;
  };
  std::uint8_t arm(McuIndex mcu, bushd_edge edge, std::uint32_t delay_us,
                   std::span<const Armed> moves);
  // None of them waits any more; those that have been started go on.
  void disarm(McuIndex mcu);
  bool can_trigger(McuIndex mcu) const;
  // The MCU has started one of them; from now on it is a table run like any other.
  void follow_table_run(McuIndex mcu, std::uint8_t motor, Tick start, std::int32_t steps);
  // When the MCU's reference output pulses from now on. Precondition: it has one.
  void reference(McuIndex mcu, const bushd_reference& message);
  bool has_reference(McuIndex mcu) const;
  // The source's answer for these motors has changed from `first` on.
  void replace(McuIndex mcu, std::uint16_t motors, Tick first);
  // Nothing more is sent for this motor.
  void drop(McuIndex mcu, std::uint8_t motor);

  // Every motor of every MCU stops within two ticks of hearing it, and nothing more is sent for
  // any. Said again until all MCUs that are online have latched BUSHD_FAULT_EMERGENCY.
  void emergency_stop(bushd_how how);

  // Other tables or motors for an MCU, at rest: it goes through configuration again and comes back
  // with kOnline.
  void reconfigure(McuIndex mcu, McuSetup setup);
  // Why the MCU has no room for these tables, as far as it is known; "": it has.
  std::string no_room(McuIndex mcu, const McuSetup& setup) const;

  // Sent as soon as the line allows, answered in later reports.
  void control(McuIndex mcu, std::uint8_t actions);
  void set_position(McuIndex mcu, std::uint8_t motor, std::int32_t position_steps);

  void home(McuIndex mcu, const bushd_home& message);

  // Requests made by calls above are not yet answered, or not yet seen in a report.
  bool busy(McuIndex mcu) const { return !mcus_[mcu].script.empty() || mcus_[mcu].poll_wanted; }

  const McuHealth& health(McuIndex mcu) const { return mcus_[mcu].health; }
  const BusHealth& bus_health() const { return transactions_.health(); }
  void reset_low_water();

 private:
  struct Gap {
    Tick until = 0;     // where the ticks begin that the MCU has beyond it
    Tick known_to = 0;  // and end
  };
  struct Stream {
    bool active = false;
    bool finished = false;  // all is sent; until dropped it may still be repeated or replaced
    Tick start = 0;
    Tick next = 0;           // first tick not yet sent, or to be sent again
    Tick sent = 0;           // first tick never sent
    std::optional<Gap> gap;  // while what lies before it is sent again
    // Since a replacement failed: beyond `sent` the MCU may have ticks of the plan before it,
    // behind a gap. Reports need not show them, so the next replacement takes them away.
    bool unsure = false;
    // Of a table run, until it is replaced.
    std::optional<std::int32_t> run_steps;
  };
  struct Request {
    std::uint8_t type = 0;
    std::vector<std::uint8_t> payload;
  };
  struct Mcu : McuRecord {
    std::array<Stream, BUSHD_MOTORS_PER_MCU> stream;
    std::deque<Request>
        script;             // requests to make in this order, each acknowledged before the next
    bool scripted = false;  // while connecting: the script has been written
    // EN as wanted; empty until the first report tells how the MCU was found. Drivers that somebody
    // switched off stay off through restarts and lost links: there may be hands in the mechanism.
    std::optional<bool> powered;
    // While connecting: table runs of an earlier master are to be stopped, and were.
    bool ramp_down_now = false;
    bool taken_over = false;
    std::int64_t poll_due_us = 0;
    std::int64_t retry_due_us = 0;
    unsigned looks = 0;             // IDENTIFYs in a row without an MCU that fits
    int silent = 0;                 // requests in a row without an answer
    std::uint8_t epoch = 0;         // of frames
    std::uint8_t newest_epoch = 0;  // of all replacements, whether taken or not
    std::uint16_t replacing = 0;    // motors of a replacement to be sent
    Tick replace_at = 0;
    std::uint16_t replaced = 0;     // motors of a replacement sent and not yet confirmed
    bool asked_since_mark = false;  // and has answered
    // Counters as last told: what they have grown by goes into `health`.
    std::uint16_t crc_errors_told = 0;
    std::uint16_t rejected_told = 0;
    std::uint16_t run_downs_told = 0;
  };
  // What MCUs' reports say of the last mark.
  struct MarkSurvey {
    bool listening = false;  // somebody would hear a SYNC
    bool all_heard = true;   // of those, each has reported
    bool waiting = false;    // an MCU does not know the time yet
    bool anybody = false;    // an MCU knows it
    bool all_asked = true;   // all who know it have reported since the mark
    bool agreed = true;      // and agree when it was
    const bushd_report* reference = nullptr;
  };
  struct Emergency {
    bushd_how how;
    std::int64_t due_us = 0;
    std::int64_t until_us = 0;  // 0: not yet said
  };

  // master.cpp
  bool send_next(std::int64_t now_us);
  bool send_emergency(std::int64_t now_us);
  bool send_ramp_down(std::int64_t now_us);
  bool send_script(std::int64_t now_us);
  Tick ticks_in(std::int64_t us) const;  // rounded up

  // master_receive.cpp: answers, and their absence
  bool answered(std::int64_t now_us, const Transactions::Answer& answer) override;
  bool unanswered(std::int64_t now_us, McuIndex mcu, std::uint8_t type) override;
  void ended(std::int64_t now_us, McuIndex mcu, std::uint8_t type) override;
  void overheard(std::int64_t now_us, const bushd_frame& frame) override;
  void handle_report(std::int64_t now_us, const Transactions::Answer& answer,
                     const bushd_report& report);
  void note_health(Mcu& mcu, const bushd_report& report);

  // master_poll.cpp
  bool send_wanted_poll(std::int64_t now_us);
  bool send_due_poll(std::int64_t now_us);

  // master_connect.cpp
  bool send_due_identify(std::int64_t now_us);
  void finish_identify(std::int64_t now_us, McuIndex mcu);
  void handle_identity(std::int64_t now_us, McuIndex mcu, const bushd_identity& identity);
  void handle_tables(McuIndex mcu, const bushd_tables& held);
  void handle_acknowledgement(std::int64_t now_us, McuIndex mcu, std::uint8_t type,
                              std::uint8_t status);
  void follow_connecting(std::int64_t now_us, McuIndex mcu, bool in_step);
  std::string unfit(const Mcu& mcu, const bushd_identity& identity) const;  // "" when it fits
  template <class Encode>
  static void add_request(Mcu& mcu, std::uint8_t type, Encode encode);
  static void add_control(Mcu& mcu, std::uint8_t actions);
  static void add_disarm(Mcu& mcu);
  static void add_table(Mcu& mcu, std::uint8_t slot);
  void write_script(Mcu& mcu) const;
  void go_offline(McuIndex mcu, const std::string& cause, std::int64_t retry_due_us);

  // master_stream.cpp
  // Of a motor whose replacement still waits, the next ticks belong to a plan that the MCU does not
  // know.
  static bool sendable(const Mcu& mcu, unsigned motor) {
    const Stream& stream = mcu.stream[motor];
    return stream.active && !stream.finished && (mcu.replacing >> motor & 1) == 0;
  }
  bool fail_late_replacements(std::int64_t now_us);
  bool send_due_replacement(std::int64_t now_us);
  bool send_stream(std::int64_t now_us, std::int64_t lead_us, bool only_replaced = false);
  bool send_ticks_of(std::int64_t now_us, McuIndex mcu, Tick now, Tick lead);
  bool send_table_runs(std::int64_t now_us, McuIndex mcu, std::uint16_t mask, Tick first);
  bool send_table_ticks(std::int64_t now_us, McuIndex mcu, std::uint16_t mask, Tick first,
                        Tick max_ticks, unsigned flags);
  void send_ticks(std::int64_t now_us, McuIndex mcu, std::uint16_t mask, Tick first, unsigned count,
                  unsigned flags);
  void note_sent(McuIndex mcu, std::uint8_t motor, Tick first, Tick until);
  void follow_replacements(McuIndex mcu);
  // An MCU in tick `now` or later can no longer change tick `at`.
  static bool too_late(Tick at, Tick now) { return at < now + 2; }
  void follow_streams(McuIndex mcu);
  static void go_back(Mcu& mcu, std::uint8_t motor);
  void drop_streams(Mcu& mcu);

  // master_sync.cpp
  std::int64_t mark_difference_ns(const bushd_report& a, const bushd_report& b) const;
  MarkSurvey survey_marks() const;
  void survey_mark(const Mcu& mcu, MarkSurvey& survey) const;
  void note_offsets(const bushd_report* reference);
  bool send_due_sync(std::int64_t now_us);

  BusSetup setup_;
  TickSource& source_;
  BusClock clock_;
  PerMcu<Mcu> mcus_;
  bool port_open_ = false;
  FrameWriter writer_;
  Transactions transactions_;
  std::vector<Event> events_;
  std::int64_t sync_due_us_ = 0;
  std::int64_t stepped_us_ = 0;
  std::optional<std::uint32_t> mark_;  // of the last SYNC sent
  bool disagreed_ = false;             // MCUs, about the mark before
  std::optional<Emergency> emergency_;
  std::int64_t other_master_until_us_ = INT64_MIN;
  std::uint16_t salt_ = 0;
  std::vector<bushd_identity> identities_;  // that the present IDENTIFY was answered with
  std::size_t script_turn_ = 0;             // whose request is sent next
};

template <class Encode>
void Master::add_request(Mcu& mcu, std::uint8_t type, Encode encode) {
  Request request{.type = type, .payload = std::vector<std::uint8_t>(BUSHD_FRAME_MAX_PAYLOAD)};
  request.payload.resize(encode(request.payload.data()));
  mcu.script.push_back(std::move(request));
}

}  // namespace bushd::link
