// What the daemon needs of any bus, whatever its MCUs, or what stands in for them, speak: a machine
// without I/O that takes time and received bytes, and gives bytes to send and events. The services
// know no more of a bus than this.
//
// Every bus reports its MCUs in the same words: McuView with phase, identity and the last report,
// and events when that changes. What an MCU reports of a tick is true of that tick: a motor's
// position is where its plan (the TickSource) leads at the beginning of McuView::tick, unless a
// limit, a fault, homing or a travel moves it otherwise. Ticks never run backwards. How fast they
// run is the bus's own affair; another bus's ticks say nothing about this one's.
//
// What only some buses can do is asked for by a capability. A kind that cannot inherits the answer
// no; then the functions behind that capability are never called, and it does not have them.
//
// Not thread-safe; all times are microseconds of one monotonic clock.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "bus/rs485/bus_setup.h"
#include "bus/rs485/event.h"
#include "bus/rs485/health.h"
#include "bus/rs485/line_pace.h"
#include "bus/rs485/mcu_index.h"
#include "bus/rs485/mcu_record.h"
#include "bus/rs485/pulse_port.h"
#include "bus/rs485/rehearsal.h"
#include "bus/rs485/table_run.h"
#include "bus/rs485/tick.h"
#include "engine/message.h"

namespace bushd::link {

class BusMaster {
 public:
  BusMaster() = default;
  virtual ~BusMaster() = default;
  BusMaster(const BusMaster&) = delete;
  BusMaster& operator=(const BusMaster&) = delete;

  // --- Bytes and time

  virtual void port_opened(std::int64_t now_us) = 0;
  virtual void port_lost(std::int64_t now_us, const std::string& cause) = 0;
  virtual void receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) = 0;
  // Does what is due. The returned bytes are to be sent now; they stay valid until the next call.
  virtual std::span<const std::uint8_t> step(std::int64_t now_us) = 0;
  // What the last step() orders of a port that is more than bytes; answered by pulse_status. Null:
  // nothing.
  virtual const PulseOrder* pulse_order() const { return nullptr; }
  virtual void pulse_status(std::int64_t, const PulseStatus&) {}
  // step() has nothing to do before this time, unless bytes arrive or a call below is made.
  virtual std::int64_t next_wake_us() const = 0;
  // Events since the last call.
  virtual std::vector<Event> take_events() = 0;

  // --- What is known

  virtual const McuView& view(McuIndex mcu) const = 0;
  virtual bool time_known() const = 0;
  virtual Tick tick_at(std::int64_t now_us) const = 0;
  virtual const McuHealth& health(McuIndex mcu) const = 0;
  virtual const BusHealth& bus_health() const = 0;
  virtual void reset_low_water() = 0;
  // Requests made by calls below are not yet answered, or not yet seen in a report.
  virtual bool busy(McuIndex mcu) const = 0;
  // Something of this bus has answered since the port was opened: it is the right port. Kinds that
  // nothing answers unasked take it for that.
  virtual bool heard() const { return true; }
  // Another master was heard on this line within the last seconds.
  virtual bool two_masters(std::int64_t) const { return false; }

  // --- Motion that the tick source plans

  // Every displacement of every tick reaches the motor in its tick: lines, paths and trajectories
  // need that. Where it is no, a motor makes runs of its table, at least as slow as the table says,
  // and its ticks wait for it.
  virtual bool streams() const { return false; }
  // Motors make their parts of a line's run with motors of other buses that answer yes, each by
  // itself and no faster than the slowest (line_pace.h). Then the bus has one motor.
  virtual bool keeps_pace() const { return false; }
  virtual void begin_in_pace(McuIndex, std::uint8_t, Tick /*start*/, LinePace::Place) {}
  // A motor of an MCU begins only when no other one of it moves: precondition of begin().
  virtual bool one_at_a_time() const { return false; }

  // Earliest tick at which a move of this motor can start.
  virtual Tick earliest_start(std::int64_t now_us, McuIndex mcu, std::uint8_t motor) const = 0;
  // Earliest tick from which replacements can take effect that are asked for together, one for each
  // MCU, in the order of MCUs: a stop of many motors takes the line longer than that of one.
  virtual Tick earliest_replace(std::int64_t now_us, std::span<const ToReplace> together) const = 0;
  // The same for another target of a motor whose run begins at tick `start`: as long as it has not
  // begun, it can begin otherwise only there.
  virtual Tick earliest_retarget(std::int64_t now_us, std::span<const ToReplace> together,
                                 Tick start) const = 0;
  // The bus has time for a replacement that is not urgent, such as another target.
  virtual bool has_time_to_retarget(std::int64_t, McuIndex) const { return true; }
  // From `start` on, until dropped, the source has ticks for this motor. Preconditions: the MCU is
  // online, the motor has a table, start >= earliest_start.
  virtual void begin(McuIndex mcu, std::uint8_t motor, Tick start) = 0;
  // The source's answer for these motors has changed from `first` on.
  virtual void replace(McuIndex mcu, std::uint16_t motors, Tick first) = 0;
  // Nothing more is sent for this motor.
  virtual void drop(McuIndex mcu, std::uint8_t motor) = 0;
  // Every motor of every MCU stops as soon as can be, and nothing more is sent for any. Said again
  // until all MCUs that are online have latched BUSHD_FAULT_EMERGENCY. It binds all of them
  // (McuView::bound_by_stop): one that comes later has it latched before it is set up. So does one
  // that an MCU tells of. Only CLEAR_FAULTS that the MCU has carried out frees it.
  virtual void emergency_stop(bushd_stop_mode mode) = 0;
  // Binds an MCU that is not online to a stop that is not cleared.
  virtual void bind_to_stop(McuIndex mcu, bushd_stop_mode mode) = 0;
  // The daemon ends: drivers of MCUs that come from now on are not enabled by the setup, since
  // their motors would move to be settled.
  virtual void enable_no_more() {}

  // --- What is asked of an MCU, and answered in later reports

  // Other tables or motors for an MCU, at rest: it goes through configuration again and comes back
  // with McuOnline.
  virtual void reconfigure(McuIndex mcu, McuSetup setup) = 0;
  // The MCU has room for these tables, as far as it is known; or why not.
  virtual Result<void> check_room(McuIndex, const McuSetup&) const { return {}; }
  virtual void control(McuIndex mcu, std::uint8_t actions) = 0;
  virtual void set_position(McuIndex mcu, std::uint8_t motor, std::int32_t position_steps) = 0;

  // --- Capabilities, told by the identity of the MCU, and what needs them

  // BUSHD_CAN_HOME
  bool can_home(McuIndex mcu) const { return can(mcu, BUSHD_CAN_HOME); }
  virtual void home(McuIndex, const bushd_home&) {}

  // Instead of begin() the MCU gets the whole move at once and runs it by the motor's table. `run`
  // is the source's from `start` on.
  bool can_run_tables(McuIndex mcu) const { return can(mcu, BUSHD_CAN_TABLE_RUN); }
  // With shortest delays, and slow delays of homing, that are no codes (engine/table.h).
  bool can_run_slowly(McuIndex mcu) const { return can(mcu, BUSHD_CAN_SLOW_RUNS); }
  virtual void begin_table_run(McuIndex, std::uint8_t, Tick, TableRun) {}

  // The same for a motor's part of a run of a line, by this table and shortest delay. `alone`: all
  // motors of the MCU are on it. Precondition also: the MCU has no other line.
  virtual bool can_run_line(McuIndex, const bushd_table&, bushd_delay /*shortest_delay*/,
                            bool /*alone*/) const {
    return false;
  }
  // It can make runs of lines, and may: ticks need not be told one by one.
  virtual bool makes_lines(McuIndex) const { return false; }
  // Whether an MCU that makes lines is fast enough for this one.
  virtual bool keeps_up_with(McuIndex, const bushd_table&, bushd_delay /*shortest_delay*/,
                             bool /*alone*/) const {
    return false;
  }
  virtual void begin_line_run(McuIndex, std::uint8_t, Tick, const LineRun&) {}
  // The bank of a table that makes the same runs as this one.
  virtual std::optional<std::uint8_t> bank_of(McuIndex, const bushd_table&) const {
    return std::nullopt;
  }

  // A table that lines go by, into a bank that the MCU does not keep over resets, in place of what
  // was there: from when it is there bank_of() finds it. It is sent in parts when nothing else is
  // asked of the MCU, which is not busy() with it. The MCU takes it only while it rests: otherwise
  // the upload ends without it. Preconditions of upload(): can_upload, the MCU is online.
  virtual bool can_upload(McuIndex, const bushd_table&) const { return false; }
  virtual void upload(McuIndex, const bushd_table&) {}
  virtual bool uploads(McuIndex) const { return false; }
  virtual void end_upload(McuIndex) {}

  // Runs of the MCU's motors that an edge at its trigger input starts. What becomes of them its
  // reports tell, from when they have the number returned here. Preconditions: the MCU is online
  // and can, the motors have tables and are at rest, no others wait (McuView::report.armed).
  struct Armed {
    std::uint8_t motor;
    TableRun run;
  };
  bool can_trigger(McuIndex mcu) const { return can(mcu, BUSHD_CAN_TRIGGER); }
  virtual std::uint8_t arm(McuIndex, bushd_edge, std::uint32_t, std::span<const Armed>) {
    return 0;
  }
  // The same for the motors' parts of one run of a line. Precondition also: the MCU has no other
  // line.
  struct ArmedOnLine {
    std::uint8_t motor;
    LineRun run;
  };
  bool can_arm_lines(McuIndex mcu) const {
    return can_trigger(mcu) && can(mcu, BUSHD_CAN_LINE_RUN);
  }
  virtual std::uint8_t arm_line(McuIndex, bushd_edge, std::uint32_t, std::span<const ArmedOnLine>) {
    return 0;
  }
  // None of them waits any more; those that have been started go on.
  virtual void disarm(McuIndex) {}
  // The MCU has started one of them; from now on it is a run like any other.
  virtual void follow_run(McuIndex, std::uint8_t, Tick, const McuRun&) {}

  // A motor travels, or makes a step that its sensor has to see, by itself; how that goes is told
  // by reports, from when they have the number returned here. `message`: without number.
  // Preconditions as of arm; the MCU has answered all that it was asked.
  bool can_travel(McuIndex mcu) const { return can(mcu, BUSHD_CAN_TRAVEL); }
  virtual std::uint8_t travel(McuIndex, bushd_travel) { return 0; }
  // It travels no more.
  virtual void end_travel(McuIndex, std::uint8_t) {}

  // These of the motors that people move at the MCU are not theirs, until this says otherwise: one
  // that they move ramps down. The MCU refuses to give one back that moves.
  virtual void inhibit_local(McuIndex, std::uint16_t /*motors*/) {}

  // When the MCU's position compare output pulses from now on. Precondition: it has one.
  bool can_compare_position(McuIndex mcu) const { return can(mcu, BUSHD_CAN_POSITION_COMPARE); }
  virtual void position_compare(McuIndex, const bushd_position_compare&) {}

  // Everything that decides what would go out now (rehearsal.h); nothing where that is not counted
  // in advance.
  virtual std::optional<BusSnapshot> snapshot(std::int64_t) const { return std::nullopt; }

 protected:
  bool can(McuIndex mcu, std::uint32_t capability) const {
    return (view(mcu).identity.capabilities & capability) != 0;
  }
};

}  // namespace bushd::link
