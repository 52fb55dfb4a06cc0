// What only some buses can do. Each is an interface of its own; a bus that has it offers it
// (BusMaster::offers), and the null pointer says that it does not.
//
// What a bus offers, not each of its MCUs need have: where that is so, the identity of the MCU
// tells (BUSHD_CAN_...), and only then the functions are called for it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bus/rs485/line_pace.h"
#include "bus/rs485/mcu_index.h"
#include "bus/rs485/pulse_port.h"
#include "bus/rs485/rehearsal.h"
#include "bus/rs485/request.h"
#include "bus/rs485/table_run.h"
#include "bus/rs485/tick.h"
#include "engine/message.h"

namespace bushd::link {

// Its port is more than bytes.
class PulsePort {
 public:
  virtual ~PulsePort() = default;
  // What the last step() orders of it; answered by pulse_status. Null: nothing.
  virtual const PulseOrder* pulse_order() const = 0;
  virtual void pulse_status(std::int64_t now_us, const PulseStatus& status) = 0;
};

// Its line is one that MCUs, and other masters, share.
class SharedLine {
 public:
  virtual ~SharedLine() = default;
  // Something has answered since the port was opened: it is the right port.
  virtual bool heard() const = 0;
  // Another master was heard within the last seconds.
  virtual bool two_masters(std::int64_t now_us) const = 0;
  // It has time for a replacement that is not urgent, such as another target.
  virtual bool has_time_to_retarget(std::int64_t now_us, McuIndex mcu) const = 0;
  virtual void reset_low_water() = 0;
  // The daemon ends: drivers of MCUs that come from now on are not enabled by the setup, since
  // their motors would move to be settled.
  virtual void enable_no_more() = 0;
  // Everything that decides what would go out now (rehearsal.h).
  virtual BusSnapshot snapshot(std::int64_t now_us) const = 0;
};

// BUSHD_CAN_HOME
class Homing {
 public:
  virtual ~Homing() = default;
  virtual void home(McuIndex mcu, const bushd_home& message) = 0;
};

// BUSHD_CAN_TABLE_RUN; BUSHD_CAN_SLOW_RUNS: also with shortest delays, and slow delays of homing,
// that are no codes (engine/table.h).
class TableRuns {
 public:
  virtual ~TableRuns() = default;
  // Instead of begin() the MCU gets the whole move at once and runs it by the motor's table. `run`
  // is the source's from `start` on.
  virtual void begin_table_run(McuIndex mcu, std::uint8_t motor, Tick start, TableRun run) = 0;
};

// Runs of lines that MCUs make by themselves, each motor its part.
class LineRuns {
 public:
  virtual ~LineRuns() = default;
  // It can make runs of lines, and may: ticks need not be told one by one.
  virtual bool makes_lines(McuIndex mcu) const = 0;
  // Whether an MCU that makes lines is fast enough for this one. `alone`: all motors of the MCU are
  // on it.
  virtual bool keeps_up_with(McuIndex mcu, const bushd_table& table, bushd_delay shortest_delay,
                             bool alone) const = 0;
  // It keeps up, and has the table.
  virtual bool can_run_line(McuIndex mcu, const bushd_table& table, bushd_delay shortest_delay,
                            bool alone) const = 0;
  // The bank of a table that makes the same runs as this one.
  virtual std::optional<std::uint8_t> bank_of(McuIndex mcu, const bushd_table& table) const = 0;
  // As TableRuns::begin_table_run. Preconditions: can_run_line, and the MCU has no other line.
  virtual void begin_line_run(McuIndex mcu, std::uint8_t motor, Tick start, const LineRun& run) = 0;
};

// A table that lines go by, into a bank that the MCU does not keep over resets, in place of what
// was there: from when it is there LineRuns::bank_of finds it. It is sent in parts when nothing
// else is asked of the MCU, which is not busy() with it. The MCU takes it only while it rests:
// otherwise the upload ends without it.
class Uploads {
 public:
  virtual ~Uploads() = default;
  virtual bool can_upload(McuIndex mcu, const bushd_table& table) const = 0;
  // Preconditions: can_upload, the MCU is online.
  virtual void upload(McuIndex mcu, const bushd_table& table) = 0;
  virtual bool uploads(McuIndex mcu) const = 0;
  virtual void end_upload(McuIndex mcu) = 0;
};

// BUSHD_CAN_TRIGGER: runs of the MCU's motors that an edge at its trigger input starts. What
// becomes of them its reports tell, from when they have the number returned here. Preconditions:
// the MCU is online, the motors have tables and are at rest, no others wait
// (McuView::report.armed).
class Trigger {
 public:
  struct Armed {
    std::uint8_t motor;
    TableRun run;
  };
  struct ArmedOnLine {
    std::uint8_t motor;
    LineRun run;
  };
  virtual ~Trigger() = default;
  virtual std::uint8_t arm(McuIndex mcu, bushd_edge edge, std::uint32_t delay_us,
                           std::span<const Armed> moves) = 0;
  // Arms the motors' parts of one run of a line (BUSHD_CAN_LINE_RUN). Precondition also: the MCU
  // has no other line.
  virtual std::uint8_t arm_line(McuIndex mcu, bushd_edge edge, std::uint32_t delay_us,
                                std::span<const ArmedOnLine> parts) = 0;
  // None of them waits any more; those that have been started go on.
  virtual void disarm(McuIndex mcu) = 0;
  // The MCU has started one of them; from now on it is a run like any other.
  virtual void follow_run(McuIndex mcu, std::uint8_t motor, Tick start, const McuRun& run) = 0;
};

// BUSHD_CAN_TRAVEL: a motor travels, or makes a step that its sensor has to see, by itself; how
// that goes is told by reports, from when they have the number returned here.
class Travel {
 public:
  virtual ~Travel() = default;
  // `message`: without number. Preconditions: the MCU is online and has answered all that it was
  // asked, the motor has a table and is at rest.
  virtual std::uint8_t travel(McuIndex mcu, bushd_travel message) = 0;
  // It travels no more.
  virtual void end_travel(McuIndex mcu, std::uint8_t motor) = 0;
};

// People move motors at the MCU.
class LocalInputs {
 public:
  virtual ~LocalInputs() = default;
  // These of the motors that people move are not theirs, until this says otherwise: one that they
  // move ramps down. The MCU refuses to give one back that moves.
  virtual void inhibit_local(McuIndex mcu, std::uint16_t motors) = 0;
};

// Messages that an MCU only acknowledges (request.h: Unnumbered). Preconditions: the MCU is online,
// and has the capabilities that the message needs.
class Requests {
 public:
  virtual ~Requests() = default;
  template <Unnumbered Message>
  void ask(McuIndex mcu, const Message& message) {
    ask(mcu, request_of(message));
  }

 protected:
  virtual void ask(McuIndex mcu, Request request) = 0;
};

// Motors make their parts of a line's run with motors of other buses that offer this, each by
// itself and no faster than the slowest (line_pace.h). Then the bus has one motor.
class PacedLines {
 public:
  virtual ~PacedLines() = default;
  virtual void begin_in_pace(McuIndex mcu, std::uint8_t motor, Tick start,
                             LinePace::Place place) = 0;
};

// What is known of the program of an MCU.
struct ProgramView {
  // PROGRAM_STATE has been answered since the MCU answered last after a silence or boot.
  bool known = false;
  bushd_program_state state{};  // the last answer
  std::int64_t heard_us = 0;    // when it came
  // The upload that is under way, or the last one.
  std::size_t put = 0;    // bytes that the MCU has taken
  std::size_t total = 0;  // 0: none has been asked for since the MCU was found
  bool uploading = false;
  std::uint8_t refused = BUSHD_OK;  // bushd_status with which the MCU ended it

  // It has motors: from when RUN is taken until they rest.
  bool under_way() const {
    return state.stage >= BUSHD_PROGRAM_WAITS && state.stage <= BUSHD_PROGRAM_ENDS;
  }
};

// BUSHD_CAN_PROGRAM: a program in the memory of an MCU (engine/program.h), which moves its motors
// by itself. ProgramReported says that its view is new.
class Programs {
 public:
  virtual ~Programs() = default;
  virtual const ProgramView& program(McuIndex mcu) const = 0;
  // In place of the one before: parts, then the commit; nothing runs before that. It is sent when
  // nothing else is asked of the MCU, which is not busy() with it. Preconditions: the MCU is
  // online, none of its programs is under way, the size is as bushd_program_check allows.
  virtual void put_program(McuIndex mcu, std::vector<std::uint8_t> bytes) = 0;
  virtual void erase_program(McuIndex mcu) = 0;  // also ends an upload
  // The earliest tick at which programs of these MCUs can begin together.
  virtual Tick earliest_program_start(std::int64_t now_us,
                                      std::span<const McuIndex> mcus) const = 0;
  // Its motors are the program's from `start` on. It is taken or refused (RequestRefused) before
  // that tick. Preconditions: the MCU is online, nothing is being uploaded, the number is 1..255
  // and not that of the state.
  virtual void run_program(McuIndex mcu, std::uint8_t number, Tick start) = 0;
  // What was asked of the program before and has not been sent is discarded, and not told of. Also
  // for an MCU that is still connecting.
  virtual void stop_program(McuIndex mcu, bushd_stop_mode mode) = 0;
  virtual void pause_program(McuIndex mcu) = 0;
  virtual void resume_program(McuIndex mcu) = 0;
};

struct Offers {
  // Every displacement of every tick reaches the motor in its tick: lines, paths and trajectories
  // need that. Where it is no, a motor makes runs of its table, at least as slow as the table says,
  // and its ticks wait for it.
  bool streams = false;
  // A motor of an MCU begins only when no other one of it moves: precondition of begin().
  bool one_at_a_time = false;
  PulsePort* pulse_port = nullptr;
  SharedLine* shared_line = nullptr;
  Homing* homing = nullptr;
  TableRuns* table_runs = nullptr;
  LineRuns* line_runs = nullptr;
  Uploads* uploads = nullptr;
  Trigger* trigger = nullptr;
  Travel* travel = nullptr;
  LocalInputs* local_inputs = nullptr;
  Requests* requests = nullptr;
  PacedLines* paced_lines = nullptr;
  Programs* programs = nullptr;
};

}  // namespace bushd::link
