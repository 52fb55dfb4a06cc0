// Streams: ticks on their way to the MCUs, and what reports say of those sent.
//
// A motor that runs by its table is told its run's state (TABLE_TICKS) where that is shorter than
// its displacements, and so as many ticks at once as its MCU can hold. What a report shows as
// missing is sent again, and only that: an MCU keeps what it has beyond a gap.
//
// Which frame goes out is decided by records and clock alone, so a dry run gives it copies and a
// writer of its own.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bus/rs485/bus_clock.h"
#include "bus/rs485/bus_setup.h"
#include "bus/rs485/common_start.h"
#include "bus/rs485/event.h"
#include "bus/rs485/frame_writer.h"
#include "bus/rs485/mcu_index.h"
#include "bus/rs485/mcu_record.h"
#include "bus/rs485/table_run.h"
#include "bus/rs485/tick_source.h"
#include "engine/message.h"

namespace bushd::link {

// While there is something to send, it is looked for this often.
inline constexpr std::int64_t kStreamWakeUs = 5'000;

// Motors of an MCU whose plan is to change, all with one frame.
struct ToReplace {
  McuIndex mcu;
  std::uint16_t motors;
};

class StreamScheduler {
 public:
  // All of them outlive it.
  struct Surroundings {
    const BusSetup& setup;
    PerMcu<McuRecord>& mcus;
    const BusClock& clock;
    TickSource& source;
    FrameWriter& writer;
    std::vector<Event>& events;
  };
  explicit StreamScheduler(const Surroundings& around);

  // See Rs485Master for these. Preconditions: as there.
  void begin(McuIndex mcu, std::uint8_t motor, Tick start);
  void begin_run(McuIndex mcu, std::uint8_t motor, Tick start, const McuRun& run);
  void follow_run(McuIndex mcu, std::uint8_t motor, Tick start, const McuRun& run);
  void replace(McuIndex mcu, std::uint16_t motors, Tick first, std::int64_t now_us);
  void drop(McuIndex mcu, std::uint8_t motor);

  // Nothing more is sent to this MCU.
  void drop_all(McuIndex mcu);
  // The MCU takes streams from now on.
  void came_online(McuIndex mcu);
  // The MCU's record has a new report.
  void follow_report(McuIndex mcu);

  // To be called once in a step, before anything is sent. Until its source has planned anew, which
  // it does between two steps, a motor whose replacement failed has no ticks that could be sent:
  // none of it are, in this step.
  void fail_late_replacements(std::int64_t now_us);
  // Called once in a step, before anything is sent. A start that has not been sent and would arrive
  // too late is not sent: StartMissed says so.
  void fail_late_starts(std::int64_t now_us);
  bool send_due_replacement(std::int64_t now_us);
  // Few frames tell of the whole run, or of as much as the MCU can hold.
  bool tells_at_once(const ToBegin& begin) const;
  // How long the line takes for the first frames of these motors. Precondition: tells_at_once.
  std::int64_t first_frames_us(const ToBegin& begin) const;
  // How long it takes for frames that keep these from beginning.
  std::int64_t withdrawal_us(std::span<const ToBegin> together) const;
  // The share of the line that all streams take that are not yet told to their ends, and these.
  double load_with(std::span<const ToBegin> more) const;
  bool tells_states(McuIndex mcu) const;  // of runs, in place of ticks
  // See BusMaster. While it is not confirmed its MCUs are asked as soon as their frames are sent.
  void confirm_start(Tick at);
  // An MCU has been sent what a motor of such a start needs, and is to say whether it has it.
  bool start_is_open(McuIndex mcu) const;
  // Called once in a step, before anything is sent: StartUnconfirmed for those that are not
  // confirmed, if there is no time for `margin_us` before frames that keep them from beginning, on
  // a line that is free from `free_us` on. Returns whether one was not confirmed in time.
  bool withdraw_late_starts(std::int64_t free_us, std::int64_t margin_us);
  // When that will be; INT64_MAX: no start is to be confirmed.
  std::int64_t withdrawal_due_us(std::int64_t free_us, std::int64_t margin_us) const;
  // A replacement waits that keeps a motor from beginning: what StartUnconfirmed has asked for, if
  // it was done before the next step.
  bool withdraws() const;
  // When the line will have carried these replacements, one for each MCU, if they are asked for
  // now.
  struct LineUse {
    std::int64_t free_us;     // from when on the bus is free for them
    std::int64_t margin_us;   // as of send_critical
    std::int64_t confirm_us;  // until the answer to a poll that is still to be sent
  };
  std::int64_t carried_us(std::int64_t now_us, const LineUse& use,
                          std::span<const ToReplace> together) const;
  // How long the line takes for a frame of ticks to each MCU that has motors to be told of.
  std::int64_t round_us() const;
  // One frame for the MCU whose queue is emptiest, if it is not filled `lead_us` ahead. States of
  // runs cost the same however many ticks they hold: these fill it as far as `target_us` allows,
  // whatever made the frame due.
  struct Filling {
    std::int64_t lead_us;
    std::int64_t target_us;
  };
  bool send_stream(std::int64_t now_us, const Filling& filling);
  // Sends for a queue that would be empty before its turn comes again: `filling`, unless
  // replacements wait. Then these take no longer than that the queue of an MCU that has its own
  // must last, with `margin_us` to spare.
  bool send_critical(std::int64_t now_us, const Filling& filling, std::int64_t margin_us);

  // The first tick of this motor that has not been sent.
  Tick next_tick(McuIndex mcu, std::uint8_t motor) const { return mcus_[mcu].stream[motor].next; }
  bool has_ticks_to_send(McuIndex mcu) const;
  // Its motion was told and has missed its start, and the MCU has refused nothing since.
  bool start_was_lost(McuIndex mcu, std::uint8_t motor) const;
  // Its motors that have a stream or a run.
  std::uint16_t active(McuIndex mcu) const;
  // The next tick, after that of its report, at which a motor of this MCU comes to rest by its
  // plan.
  std::optional<Tick> next_end(McuIndex mcu) const;
  // The tick from which on none of them moves by its plan; none: none is active.
  std::optional<Tick> last_end(McuIndex mcu) const;
  // An MCU makes the run of a line, or is to.
  bool runs_line() const;
  bool has_replacement_to_send(McuIndex mcu) const { return mcus_[mcu].replacing != 0; }
  // A replacement has been sent to this MCU and is not yet confirmed.
  bool replacement_open(McuIndex mcu) const { return mcus_[mcu].replaced != 0; }
  // One of them has been open since `since_us`.
  bool confirmation_is_due(std::int64_t since_us) const;
  // An MCU has a queue filled less than `lead_us` ahead, as far as its queue goes.
  bool behind(std::int64_t now_us, std::int64_t lead_us) const;

 private:
  static constexpr std::uint16_t bit(unsigned motor) {
    return static_cast<std::uint16_t>(1u << motor);
  }
  // Ticks that an MCU has beyond a gap.
  struct OutOfOrderRange {
    Tick from = 0;
    Tick until = 0;
  };
  struct Stream {
    bool active = false;
    bool finished = false;  // all is sent; until dropped it may still be repeated or replaced
    bool told = false;      // something of it has been sent
    bool taken = false;     // its MCU has had all that was sent when it was asked
    // What its MCU had refused when it was first told.
    std::uint16_t refused_before = 0;
    Tick start = 0;
    // First tick that the MCU gets of it: the start, or that of a replacement before it, which
    // leads up to the start. What follows one is no start, wherever it ends.
    Tick from = 0;
    Tick from_before = 0;                       // the same, without the newest replacement
    Tick next = 0;                              // first tick not yet sent, or to be sent again
    Tick sent = 0;                              // first tick never sent
    std::optional<OutOfOrderRange> beyond_gap;  // while what lies before it is sent again
    // Since a replacement failed: beyond `sent` the MCU may have ticks of the plan before it,
    // behind a gap. Reports need not show them, so the next replacement takes them away.
    bool unsure = false;
    // Made by the MCU itself, until it is replaced.
    std::optional<McuRun> run;

    bool begun() const { return sent != from; }
    bool starts() const { return next == start && from == start; }
  };
  struct Mcu {
    std::array<Stream, BUSHD_MOTORS_PER_MCU> stream;
    std::uint8_t epoch = 0;         // of frames
    std::uint8_t newest_epoch = 0;  // of all replacements, whether taken or not
    std::uint16_t replacing = 0;    // motors of a replacement to be sent
    Tick replace_at = 0;
    std::uint16_t replaced = 0;    // motors of a replacement sent and not yet confirmed
    std::uint16_t unplanned = 0;   // motors whose replacement has failed in this step
    std::uint16_t starting = 0;    // motors whose start may be still to be sent
    bool withdraws = false;        // the replacement to be sent keeps motors from beginning
    std::int64_t replaced_us = 0;  // when that was
    unsigned failures = 0;         // of replacements, in a row

    // The next ticks of a motor whose replacement still waits, or has just failed, belong to a plan
    // that the MCU does not know.
    bool sendable(unsigned motor) const {
      return stream[motor].active && !stream[motor].finished &&
             ((replacing | unplanned) >> motor & 1) == 0;
    }
    // The first tick that is due of all motors that are sendable; none: there is none.
    std::optional<Tick> next_tick() const;
  };
  // What the next frame to an MCU may hold: the motors whose next tick is the oldest.
  struct Choice {
    Tick first;
    std::uint16_t runs = 0;     // table runs to begin
    std::uint16_t lines = 0;    // runs of lines to begin
    std::uint16_t starts = 0;   // streams to begin
    std::uint16_t goes_on = 0;  // streams to continue
    Tick join = INT64_MAX;      // where another motor, or ticks beyond a gap, join in
  };

  // stream_scheduler.cpp
  // When a replacement for these motors would be at its MCU, sent now.
  std::int64_t arrival_us(std::int64_t now_us, std::uint16_t mask, Tick ticks) const;
  // How long the line takes for a frame of so many ticks of these motors.
  std::int64_t frame_us(std::uint16_t mask, Tick ticks) const;
  // For the replacements that wait, and these.
  std::int64_t replacements_us(std::span<const ToReplace> together) const;
  void follow_replacements(McuIndex mcu);
  void follow_streams(McuIndex mcu);
  void go_back(McuIndex mcu, std::uint8_t motor);
  void miss_start(McuIndex mcu, std::uint8_t motor);

  // stream_starts.cpp
  // The motors of an MCU that are to begin at this tick, and whether it is not known that the MCU
  // has what all of them need.
  std::uint16_t to_begin_at(McuIndex mcu, Tick at) const;
  bool is_open(McuIndex mcu, Tick at) const;
  // The last tick in which frames that keep motors from beginning at this one may arrive.
  static Tick last_to_withdraw(Tick at);
  std::int64_t withdrawal_us(Tick at) const;
  bool waits_for_replacement(Tick at) const;

  // stream_frames.cpp
  void finish_ended(McuIndex mcu);
  static Choice choose(const Mcu& mcu, Tick first);
  bool send_ticks_of(std::int64_t now_us, McuIndex mcu, const Filling& filling);
  void send_table_runs(std::int64_t now_us, McuIndex mcu, std::uint16_t mask, Tick first);
  void send_line_run(std::int64_t now_us, McuIndex mcu, std::uint16_t mask, Tick first);
  bool send_table_ticks(std::int64_t now_us, McuIndex mcu, std::uint16_t mask, Tick first,
                        Tick max_ticks, unsigned flags);
  void send_ticks(std::int64_t now_us, McuIndex mcu, std::uint16_t mask, Tick first, unsigned count,
                  unsigned flags);
  void note_sent(McuIndex mcu, std::uint8_t motor, Tick first, Tick until);
  Tick ticks_per_frame(std::uint16_t mask) const;
  // Ticks in the frame of a replacement: fewer after failures, as a short frame is sooner there and
  // less often lost.
  Tick ticks_of_replacement(const Mcu& mcu, std::uint16_t mask) const;
  // The replacement that waits gives all of its motors rest, so one tick is enough.
  bool rests(McuIndex mcu) const;
  Tick ticks_of_waiting(McuIndex mcu) const;

  const BusSetup& setup_;
  PerMcu<McuRecord>& records_;
  const BusClock& clock_;
  TickSource& source_;
  FrameWriter& writer_;
  std::vector<Event>& events_;
  PerMcu<Mcu> mcus_;
  std::vector<Tick> to_confirm_;
};

}  // namespace bushd::link
