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
#include "engine/table.h"
#include "link/bus_clock.h"
#include "link/line_budget.h"

namespace bushd::link {

struct McuSetup {
  std::uint8_t address = 0;
  std::vector<const bushd_table*> tables;  // by slot, at most BUSHD_TABLE_SLOTS; outlive the master
  std::array<int, BUSHD_MOTORS_PER_MCU> table_of_motor{};  // slot, or -1: no motor at this output
};

struct BusSetup {
  std::uint32_t baud = 0;
  std::uint32_t tick_ns = 0;
  bushd_format format = BUSHD_FORMAT_FINE;
  std::vector<McuSetup> mcus;
};

// What the master needs to know of moves. `mcu` is the index in BusSetup::mcus.
class TickSource {
 public:
  virtual ~TickSource() = default;
  // Displacements of ticks first .. first+count-1 into out[0], out[stride], ...: fine ones as they
  // are, coarse ones as the byte's value. Returns the delay of the step running at the end, 0 when
  // the motor is at rest there for good. `first` may go back as far as the oldest tick that the MCU
  // has not reported as known.
  virtual std::uint16_t render(std::size_t mcu, std::uint8_t motor, Tick first, unsigned count,
                               std::int16_t* out, std::size_t stride) = 0;
};

enum class McuPhase { kOffline, kConnecting, kOnline };

struct McuView {
  McuPhase phase = McuPhase::kOffline;
  std::string detail = "not heard yet";  // why it is not online
  bool identified = false;
  bushd_identity identity{};
  bool reported = false;  // the fields below are valid
  bushd_report report{};
  Tick tick = 0;                                         // report.tick, unwrapped
  std::array<Tick, BUSHD_MOTORS_PER_MCU> known_until{};  // likewise
};

struct Event {
  enum class Kind {
    kOnline,         // configured, in step, tables in place
    kOffline,        // no answer, restarted, or port lost: McuView::detail says why
    kReport,         // McuView::report is new
    kReplaceFailed,  // a replacement was not taken; its motors go on as before. Plan it again.
    kLateStart       // the first ticks of `motor` came too late; its stream was dropped
  };
  Kind kind;
  std::size_t mcu;
  std::uint8_t motor = 0;
  std::uint16_t motors = 0;  // kReplaceFailed: the mask
};

class Master {
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

  const McuView& view(std::size_t mcu) const { return mcus_[mcu].view; }
  std::size_t mcu_count() const { return mcus_.size(); }
  bool time_known() const { return clock_.valid(); }
  Tick tick_at(std::int64_t now_us) const { return clock_.tick_at(now_us); }
  // Earliest tick at which a move of this motor can start and all its first frames still arrive
  // well before.
  Tick earliest_start(std::int64_t now_us, std::size_t mcu, std::uint8_t motor) const;
  // Earliest tick from which a replacement can take effect.
  Tick earliest_replace(std::int64_t now_us) const;

  // From `start` on, until dropped, the source has ticks for this motor. Preconditions: the MCU is
  // online, the motor has a table, start >= earliest_start.
  void begin(std::size_t mcu, std::uint8_t motor, Tick start);
  // The source's answer for these motors has changed from `first` on.
  void replace(std::size_t mcu, std::uint16_t motors, Tick first);
  // Nothing more is sent for this motor.
  void drop(std::size_t mcu, std::uint8_t motor);

  // Other tables or motors for an MCU, at rest: it goes through configuration again and comes back
  // with kOnline.
  void reconfigure(std::size_t mcu, McuSetup setup);

  // Sent as soon as the line allows, answered in later reports.
  void control(std::size_t mcu, std::uint8_t actions);
  void set_position(std::size_t mcu, std::uint8_t motor, std::int32_t position_steps);

  // Requests made by the two calls above are not yet answered, or not yet seen in a report.
  bool busy(std::size_t mcu) const { return !mcus_[mcu].script.empty() || mcus_[mcu].poll_now; }

  std::uint64_t bad_frames() const { return bad_frames_; }
  std::uint64_t timeouts() const { return timeouts_; }

 private:
  struct Stream {
    bool active = false;
    bool finished = false;  // all is sent; until dropped it may still be repeated or replaced
    Tick start = 0;
    Tick next = 0;                            // first tick not yet sent
    std::optional<std::uint16_t> delay_sent;  // as told at `next`; empty: must be told again
  };
  struct Request {
    std::uint8_t type = 0;
    std::vector<std::uint8_t> payload;
  };
  struct Mcu {
    McuSetup setup;
    McuView view;
    std::array<Stream, BUSHD_MOTORS_PER_MCU> stream;
    std::deque<Request>
        script;             // requests to make in this order, each acknowledged before the next
    bool scripted = false;  // while connecting: the script has been written
    // EN as wanted; empty until the first report tells how the MCU was found. Drivers that somebody
    // switched off stay off through restarts and lost links: there may be hands in the mechanism.
    std::optional<bool> powered;
    std::int64_t poll_due_us = 0;
    std::int64_t retry_due_us = 0;
    int silent = 0;                 // requests in a row without an answer
    std::uint8_t epoch = 0;         // of frames
    std::uint8_t newest_epoch = 0;  // of all replacements, whether taken or not
    std::uint16_t replacing = 0;    // motors of a replacement to be sent
    Tick replace_at = 0;
    std::uint16_t replaced = 0;  // motors of a replacement sent and not yet confirmed
    bool poll_now = false;
    bool asked_since_mark = false;  // and has answered
  };
  // What MCUs' reports say of the last mark.
  struct MarkSurvey {
    bool listening = false;  // somebody would hear a SYNC
    bool waiting = false;    // an MCU does not know the time yet
    bool anybody = false;    // an MCU knows it
    bool all_asked = true;   // all who know it have reported since the mark
    bool agreed = true;      // and agree when it was
    const bushd_report* reference = nullptr;
  };
  struct Outstanding {
    std::size_t mcu;
    std::uint8_t type;
    std::uint8_t tag;
    std::int64_t timeout_us;
    std::int64_t expected_us;  // when the answer ends if nothing but the line takes time
  };

  void send(std::int64_t now_us, std::uint8_t address, std::uint8_t type,
            std::span<const std::uint8_t> payload);
  void ask(std::int64_t now_us, std::size_t mcu, std::uint8_t type,
           std::span<const std::uint8_t> payload, std::size_t reply_payload);
  // Of a motor whose replacement still waits, the next ticks belong to a plan that the MCU does not
  // know.
  static bool sendable(const Mcu& mcu, unsigned motor) {
    const Stream& stream = mcu.stream[motor];
    return stream.active && !stream.finished && (mcu.replacing >> motor & 1) == 0;
  }
  bool send_next(std::int64_t now_us);
  bool fail_late_replacements(std::int64_t now_us);
  bool send_due_replacement(std::int64_t now_us);
  bool send_wanted_poll(std::int64_t now_us);
  bool send_stream(std::int64_t now_us, std::int64_t lead_us, bool only_replaced = false);
  bool send_ticks_of(std::int64_t now_us, std::size_t mcu, Tick horizon);
  void send_ticks(std::int64_t now_us, std::size_t mcu, std::uint16_t mask, Tick first,
                  unsigned count, unsigned flags);
  bool send_due_poll(std::int64_t now_us);
  std::int64_t mark_difference_ns(const bushd_report& a, const bushd_report& b) const;
  MarkSurvey survey_marks() const;
  bool send_due_sync(std::int64_t now_us);
  bool send_script(std::int64_t now_us);
  bool send_due_identify(std::int64_t now_us);
  Tick ticks_in(std::int64_t us) const;  // rounded up

  void handle_frame(std::int64_t now_us, const bushd_frame& frame);
  void handle_report(std::int64_t now_us, std::size_t mcu, const bushd_report& report);
  void handle_identity(std::int64_t now_us, std::size_t mcu, const bushd_identity& identity);
  void handle_acknowledgement(std::int64_t now_us, std::size_t mcu, std::uint8_t type,
                              std::uint8_t status);
  void follow_replacements(std::size_t mcu);
  // An MCU in tick `now` or later can no longer change tick `at`.
  static bool too_late(Tick at, Tick now) { return at < now + 2; }
  void follow_streams(std::size_t mcu);
  void answered(std::int64_t now_us);
  void handle_timeout(std::int64_t now_us);
  std::string unfit(const Mcu& mcu, const bushd_identity& identity) const;  // "" when it fits
  void write_script(Mcu& mcu) const;
  void go_offline(std::size_t mcu, const std::string& cause, std::int64_t retry_due_us);
  void drop_streams(Mcu& mcu);

  BusSetup setup_;
  TickSource& source_;
  BusClock clock_;
  std::vector<Mcu> mcus_;
  bool port_open_ = false;
  std::vector<std::uint8_t> out_;
  std::vector<Event> events_;
  bushd_receiver receiver_{};
  std::optional<Outstanding> outstanding_;
  // How long an answer may be late. All wait meanwhile, so it follows the latencies seen: from 40
  // ms, which any adapter keeps, down to 10 ms on a good one.
  static constexpr std::int64_t kMaxPatienceUs = 40'000;
  static constexpr std::int64_t kMinPatienceUs = 10'000;
  std::int64_t patience_us_ = kMaxPatienceUs;
  std::int64_t line_free_us_ = 0;  // when all that was sent has left
  std::int64_t sync_due_us_ = 0;
  std::int64_t stepped_us_ = 0;
  std::uint8_t tag_ = 0;
  std::optional<std::uint8_t> mark_tag_;  // of the last SYNC sent
  bool disagreed_ = false;                // MCUs, about the mark before
  std::uint64_t bad_frames_ = 0;
  std::uint64_t timeouts_ = 0;
};

}  // namespace bushd::link
