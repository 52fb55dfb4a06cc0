// The master of one bus as a machine without I/O: host time and received bytes go in, bytes to send
// and events come out. What motors shall do it asks from a TickSource.
//
// It is composed of machines that share the records of the MCUs (mcu_record.h), and decides which
// of them has the line next:
//
//   Transactions      a request and its answers; nothing else is sent meanwhile
//   Connector         finds and configures MCUs, and what else is asked of one of them
//   Synchroniser      keeps them in step, and knows bus time
//   StreamScheduler   keeps their tick queues filled, and repairs what was lost
//   Poller            asks for reports
//   EmergencyStop     says so until every MCU has heard it
//
// Not thread-safe; all times are microseconds of one monotonic clock.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/message.h"
#include "link/bus_setup.h"
#include "link/connector.h"
#include "link/emergency_stop.h"
#include "link/event.h"
#include "link/frame_writer.h"
#include "link/health.h"
#include "link/horizon.h"
#include "link/mcu_index.h"
#include "link/mcu_record.h"
#include "link/poller.h"
#include "link/rehearsal.h"
#include "link/stream_scheduler.h"
#include "link/synchroniser.h"
#include "link/table_run.h"
#include "link/tick_source.h"
#include "link/transactions.h"

namespace bushd::link {

class Master : private Transactions::Listener, private Connector::Listener {
 public:
  // `source` outlives it.
  Master(BusSetup setup, TickSource& source);
  Master(const Master&) = delete;
  Master& operator=(const Master&) = delete;

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
  bool time_known() const { return clock().valid(); }
  Tick tick_at(std::int64_t now_us) const { return clock().tick_at(now_us); }
  // Earliest tick at which a move of this motor can start and all its first frames still arrive
  // well before.
  Tick earliest_start(std::int64_t now_us, McuIndex mcu, std::uint8_t motor) const;
  // Earliest tick from which a replacement can take effect.
  Tick earliest_replace(std::int64_t now_us) const;
  // The same for another target of a motor whose run begins at tick `start`: as long as it has not
  // begun, it can begin otherwise only there.
  Tick earliest_retarget(std::int64_t now_us, Tick start) const;
  // Another master was heard on this line within the last seconds, by this one or by an MCU.
  bool two_masters(std::int64_t now_us) const { return synchroniser_.two_masters(now_us); }

  // From `start` on, until dropped, the source has ticks for this motor. Preconditions: the MCU is
  // online, the motor has a table, start >= earliest_start.
  void begin(McuIndex mcu, std::uint8_t motor, Tick start);
  // The same, but the MCU gets the whole move at once and runs it by the motor's table. `run` is
  // the source's from `start` on. Precondition also: the MCU can (can_run_tables).
  void begin_table_run(McuIndex mcu, std::uint8_t motor, Tick start, TableRun run);
  bool can_run_tables(McuIndex mcu) const { return can(mcu, BUSHD_CAN_TABLE_RUN); }
  // The same for a motor's part of a run of a line. Precondition: the MCU can (can_run_lines), and
  // has no other line.
  void begin_line_run(McuIndex mcu, std::uint8_t motor, Tick start, const LineRun& run);
  // Not where every tick is to be told.
  bool can_run_lines(McuIndex mcu) const {
    return setup_.table_ticks && can(mcu, BUSHD_CAN_LINE_RUN);
  }
  // Of a table of the MCU that makes the same runs as this one.
  std::optional<std::uint8_t> slot_of(McuIndex mcu, const bushd_table& table) const;
  // Everything that decides what would go out now (rehearsal.h).
  BusSnapshot snapshot(std::int64_t now_us) const;
  // Runs of the MCU's motors that an edge at its trigger input starts. What becomes of them its
  // reports tell, from when they have the number returned here. Preconditions: the MCU is online
  // and can (can_trigger), the motors have tables and are at rest, no others wait
  // (McuView::report.armed).
  struct Armed {
    std::uint8_t motor;
    TableRun run;
  };
  std::uint8_t arm(McuIndex mcu, bushd_edge edge, std::uint32_t delay_us,
                   std::span<const Armed> moves);
  // A motor travels, or makes a step that its sensor has to see, by itself; how that goes is told
  // by reports, from when they have the number returned here. `message`: without number.
  // Preconditions as of arm; the MCU can (can_travel), and has answered all that it was asked.
  std::uint8_t travel(McuIndex mcu, bushd_travel message);
  // It travels no more.
  void end_travel(McuIndex mcu, std::uint8_t motor);
  bool can_travel(McuIndex mcu) const { return can(mcu, BUSHD_CAN_TRAVEL); }
  // None of them waits any more; those that have been started go on.
  void disarm(McuIndex mcu) { connector_.queue(mcu).disarm(); }
  bool can_trigger(McuIndex mcu) const { return can(mcu, BUSHD_CAN_TRIGGER); }
  // The MCU has started one of them; from now on it is a table run like any other.
  void follow_table_run(McuIndex mcu, std::uint8_t motor, Tick start, TableRun run);
  // When the MCU's position compare output pulses from now on. Precondition: it has one.
  void position_compare(McuIndex mcu, const bushd_position_compare& message);
  bool can_compare_position(McuIndex mcu) const { return can(mcu, BUSHD_CAN_POSITION_COMPARE); }
  // The line has time for a replacement that is not urgent, such as another target: none of this
  // MCU is on its way, and no queue of the bus is about to run empty. Each replacement takes back
  // ticks that have been sent, so too many of them would leave no time for ticks.
  bool has_time_to_retarget(std::int64_t now_us, McuIndex mcu) const;
  // The source's answer for these motors has changed from `first` on.
  void replace(McuIndex mcu, std::uint16_t motors, Tick first);
  // Nothing more is sent for this motor.
  void drop(McuIndex mcu, std::uint8_t motor) { streams_.drop(mcu, motor); }

  // Every motor of every MCU stops within two ticks of hearing it, and nothing more is sent for
  // any. Said again until all MCUs that are online have latched BUSHD_FAULT_EMERGENCY.
  void emergency_stop(bushd_stop_mode mode);

  // Other tables or motors for an MCU, at rest: it goes through configuration again and comes back
  // with McuOnline.
  void reconfigure(McuIndex mcu, McuSetup setup);
  // The MCU has room for these tables, as far as it is known; or why not.
  Result<void> check_room(McuIndex mcu, const McuSetup& setup) const;

  // Sent as soon as the line allows, answered in later reports.
  void control(McuIndex mcu, std::uint8_t actions) { connector_.control(mcu, actions); }
  void set_position(McuIndex mcu, std::uint8_t motor, std::int32_t position_steps);
  void home(McuIndex mcu, const bushd_home& message) { connector_.queue(mcu).home(message); }

  // Requests made by calls above are not yet answered, or not yet seen in a report.
  bool busy(McuIndex mcu) const { return !connector_.queue(mcu).empty() || mcus_[mcu].poll_wanted; }

  const McuHealth& health(McuIndex mcu) const { return mcus_[mcu].health; }
  const BusHealth& bus_health() const { return transactions_.health(); }
  void reset_low_water();

 private:
  bool answered(std::int64_t now_us, const Transactions::Answer& answer) override;
  bool unanswered(std::int64_t now_us, McuIndex mcu, std::uint8_t type) override;
  void ended(std::int64_t now_us, McuIndex mcu, std::uint8_t type) override;
  void overheard(std::int64_t now_us, const bushd_frame& frame) override;

  void found(std::int64_t now_us, McuIndex mcu) override;
  void came_online(McuIndex mcu) override;
  void went_offline(McuIndex mcu, bool was_online) override;
  void refused(McuIndex mcu, std::uint8_t type, std::uint8_t status) override;

  void notice_standing_still(std::int64_t now_us);
  void handle_report(std::int64_t now_us, const Transactions::Answer& answer,
                     const bushd_report& report);
  bool send_next(std::int64_t now_us);
  std::int64_t wake_us(McuIndex mcu) const;
  bool can(McuIndex mcu, std::uint16_t capability) const {
    return (mcus_[mcu].view.identity.capabilities & capability) != 0;
  }
  const BusClock& clock() const { return synchroniser_.clock(); }

  const BusSetup setup_;
  PerMcu<McuRecord> mcus_;
  std::vector<Event> events_;
  bool port_open_ = false;
  std::int64_t stepped_us_ = 0;
  FrameWriter writer_;
  Transactions transactions_;
  Connector connector_;
  Synchroniser synchroniser_;
  StreamScheduler streams_;
  Poller poller_;
  EmergencyStop emergency_;
  Horizon horizon_;
};

}  // namespace bushd::link
