// The daemon without I/O: configuration, bytes, commands and time go in; bytes, replies, states and
// log lines come out. daemon/main.cpp puts ports, LCM and the clock around it; simulations put
// virtual ones.
//
// Not thread-safe; all times are microseconds of one monotonic clock.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "bushd/command_t.hpp"
#include "bushd/health_t.hpp"
#include "bushd/reply_t.hpp"
#include "bushd/state_t.hpp"
#include "config/config.h"
#include "daemon/client_log.h"
#include "link/master.h"
#include "motion/axis.h"
#include "motion/move_book.h"

namespace bushd::daemon {

enum class LogLevel { kInfo, kWarning, kError };

// Where the core's output goes. Called from within the core's functions; must not call back into
// the core.
class Outputs {
 public:
  virtual ~Outputs() = default;
  virtual void send(std::size_t bus, std::span<const std::uint8_t> bytes) = 0;
  virtual void reply(const reply_t& reply) = 0;
  virtual void state(const state_t& state) = 0;
  virtual void health(const health_t& health) = 0;
  virtual void move_log(const std::string& json_line) = 0;
  virtual void log(LogLevel level, const std::string& text) = 0;
  // Answered by Core::tables_read and Core::tables_kept, later.
  virtual void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) = 0;
  // For the next daemon: which table each group has, TABLE[@REV] in the order of the configuration.
  virtual void keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) = 0;
  virtual std::int64_t wall_clock_us() = 0;  // microseconds since 1970, for messages
};

class Core {
 public:
  static constexpr std::int64_t kStatePeriodUs = 50'000;
  // "At once on change", but not more often than this: a client that sends many commands must not
  // make the daemon flood the network.
  static constexpr std::int64_t kMinStatePeriodUs = 5'000;
  static constexpr std::int64_t kHealthPeriodUs = 1'000'000;

  // `config` must be one that config::load accepted; it and `outputs` outlive the core. `master`
  // tells this core from others on the same lines: a number that no other is likely to have.
  Core(const config::Config& config, Outputs& outputs, std::uint16_t master);
  ~Core();
  Core(const Core&) = delete;
  Core& operator=(const Core&) = delete;

  void port_opened(std::int64_t now_us, std::size_t bus);
  void port_lost(std::int64_t now_us, std::size_t bus, const std::string& cause);
  void receive(std::int64_t now_us, std::size_t bus, std::span<const std::uint8_t> bytes);

  void command(std::int64_t now_us, const command_t& command);
  // Payloads that were no valid command, so far; shown in the state.
  void set_rejected_commands(std::uint64_t count) { rejected_commands_ = count; }

  // Does what is due; to be called after every call above and at next_wake_us() at the latest.
  void step(std::int64_t now_us);
  std::int64_t next_wake_us() const;

  // Why groups that have a table by this name, and follow its changes, could not move by this one;
  // "": they could.
  std::string refuse_content(const std::string& name, const tables::TablePtr& table) const;
  // Before the first port is opened: the group has another table than the configuration says.
  Result<void> restore(std::size_t group, const std::string& wanted, tables::TablePtr table);
  // What RELOAD_TABLES does; how it ends is told by the log.
  void reload_tables();
  void tables_read(std::int64_t now_us, std::uint64_t ticket,
                   const std::vector<Result<tables::TablePtr>>& tables);
  void tables_kept(std::uint64_t ticket, const Result<void>& kept);

  // Ramps down all motors and takes no more moves.
  void shut_down(std::int64_t now_us);
  // No motor moves by this core's doing.
  bool at_rest() const;
  // When all that moves now will have come to rest, as planned.
  std::int64_t rest_by_us(std::int64_t now_us) const;

 private:
  struct Bus;
  struct Motor {
    const config::Motor* config;
    motion::Axis axis;                // with the table of its group in tables_
    std::size_t bus;                  // index in buses_
    std::size_t mcu;                  // index in mcus_
    std::uint64_t log_id = 0;         // of its present move in the log of moves
    std::int64_t position_steps = 0;  // as reported last
    std::string doubt = {};           // why the position is uncertain; empty: it is known
    bool wrong = false;               // counted otherwise than planned; it is being stopped
    int limit = 0;                    // +1, -1: its limit switch at this end stops it
    // Waits for the trigger, or for the MCU to say that it does: the axis has no start yet.
    struct Armed {
      std::uint8_t number;  // of link::Master::arm
      std::int64_t steps;
      bool stops = false;      // as soon as it has started: that came before it was disarmed
      std::string ended = {};  // the motor armed with it whose end ends it too
    };
    std::optional<Armed> armed = {};
    // Moves by itself: homes, or people move it.
    struct Alone {
      std::optional<motion::Tick> since;  // of the last report before, if there is one
      std::int64_t from_steps;
      bool homes;
      bool set = false;  // the MCU's counter does not go on from there
    };
    std::optional<Alone> alone = {};
  };
  struct Homing {
    std::size_t motor;
    bool asked = false;  // its MCU has been
  };
  struct Mcu {
    const config::Mcu* config;
    std::size_t bus;
    link::McuIndex in_bus;
    std::array<int, BUSHD_MOTORS_PER_MCU> motor_of{};  // by output; -1: none
    std::optional<std::uint16_t> boot_number;          // of the boot that positions belong to
    bool clearing = false;                             // faults are being cleared
    std::uint16_t autonomous = 0;                      // as reported last
    std::optional<motion::Tick> told = {};             // the tick of the last report
    std::deque<Homing> homings = {};                   // under way, and those that wait
  };
  struct Client {
    std::string id;
    std::int64_t number;
  };
  struct OpenMove {
    Client client;
    std::vector<tables::TablePtr> tables;  // of its motors, in the command's order
  };
  // A command that is neither answered at once nor a move: done when nothing is left to wait for.
  struct Pending {
    Client client;
    std::int8_t kind;
    std::vector<std::size_t> motors;  // STOP: still moving; DISARM: still armed; SET_POSITION: all
    std::vector<std::int64_t> steps;  // SET_POSITION
    std::vector<std::size_t> mcus;    // whose report is awaited; EMERGENCY_STOP: that do not stand
    std::int64_t deadline_us;
    std::string done = "done";  // the reason, if all goes well
  };

  struct InService {
    tables::TablePtr table;
    std::string wanted;  // TABLE[@REV] that it was asked for by
  };
  // Other tables for groups, from the command to its result (tables.cpp).
  struct TableChange {
    enum class Stage { kReading, kResting, kUploading, kKeeping };
    struct Part {
      std::size_t group;
      std::string wanted;
      tables::TablePtr table{};   // once read
      tables::TablePtr before{};  // while uploading: what it goes back to if that fails
    };
    Client client;  // without an id: not from a client
    std::uint64_t ticket;
    std::int8_t kind;
    Stage stage = Stage::kReading;
    std::vector<Part> parts{};
    std::vector<std::size_t> mcus{};     // that need other tables
    std::vector<std::size_t> awaited{};  // while uploading: those that were not offline
    std::string refused{};               // groups that keep their tables, and why
    std::string notes{};
    std::int64_t deadline_us = 0;  // of the upload
  };

  const tables::Table& table_of(const config::Motor& motor) const {
    return *service_[motor.group.value].table;
  }
  motion::Axis new_axis(const config::Motor& motor) const;
  link::Master& master_of(const Mcu& mcu);
  const link::Master& master_of(const Mcu& mcu) const;
  const link::McuView& view_of(const Mcu& mcu) const;
  std::size_t mcu_at(std::size_t bus, link::McuIndex in_bus) const;

  // events.cpp
  void handle_events(std::int64_t now_us, std::size_t bus);
  void on_online(std::size_t mcu);
  void on_offline(std::size_t mcu);
  void on_start_missed(const Mcu& mcu, std::uint8_t output);
  void on_replacement_failed(std::int64_t now_us, const Mcu& mcu, std::uint16_t outputs);
  void on_report(std::int64_t now_us, std::size_t mcu);
  void follow_motor(std::int64_t now_us, std::size_t motor, const Mcu& mcu,
                    const link::McuView& view);
  // Of an armed motor. Returns whether the rest of the report is to be looked at: it has started,
  // or a fault has put an end to it.
  bool follow_armed(std::size_t motor, const Mcu& mcu, const link::McuView& view);
  void end_faulty_motor(std::size_t motor, const Mcu& mcu, const bushd_report& report);
  // alone.cpp: before and after a report's positions are taken over.
  void notice_alone(std::size_t motor, const Mcu& mcu, const bushd_report& report);
  void end_alone(std::size_t motor, const link::McuView& view);
  static std::string did_not_start(const Mcu& mcu);  // for the reason of a move's end
  // The MCU's motors do not ramp down in what it reports.
  bool cuts(const Mcu& mcu, const bushd_report& report) const;
  void clear_link_fault(Mcu& mcu);
  // The motor's run has come to rest, or is lost: so has its part of the move.
  void end_motor(std::size_t motor, motion::Outcome outcome, const std::string& reason);
  // Its part of the move only.
  void end_part(std::size_t motor, motion::Outcome outcome, const std::string& reason);
  // The per-motor fields only.
  reply_t reply_to(const motion::MoveResult& result,
                   const std::vector<tables::TablePtr>& moved_by) const;
  static table_ref_t ref_to(const tables::Table& table);
  void log_change(const Motor& motor, const motion::Change& change);
  void log_result(const Motor& motor, const std::string& result);
  void log_set(const Motor& motor);

  // limits.cpp
  std::string refuse_direction(const Motor& motor, std::int64_t steps) const;
  void notice_limit(Motor& motor, const link::McuView& view);
  void end_at_limit(std::size_t motor);

  // commands.cpp
  std::string refuse(const command_t& command) const;  // "" when nothing speaks against it
  static std::string busy_text(const Motor& motor);    // what it does
  std::string refuse_move(std::size_t motor, std::int64_t target, std::int64_t steps) const;
  // Against any motion of this motor, as far as it is at rest.
  std::string refuse_motion(std::size_t motor) const;
  bool being_set(std::size_t motor) const;     // a SET_POSITION has no result yet
  bool being_disabled(std::size_t mcu) const;  // a DISABLE is not yet confirmed by this MCU
  std::optional<std::size_t> find_motor(const std::string& name) const;
  std::vector<std::size_t> motors_named(const command_t& command) const;  // none named: all
  std::vector<std::size_t> mcus_of(const std::vector<std::size_t>& motors) const;
  // Where the i-th motor of a move shall go. Of one that moves, "by" counts from its present
  // target.
  std::int64_t target_of(const command_t& command, std::size_t i) const;
  void start_move(std::int64_t now_us, const command_t& command);
  void dry_run(std::int64_t now_us, const command_t& command);  // dry_run.cpp
  // trigger.cpp
  std::string refuse_arming(const command_t& command) const;
  std::string refuse_reference(const command_t& command) const;
  void arm(const command_t& command);
  void disarm(const std::vector<std::size_t>& motors);
  // Disarmed; those whose trigger has come before that are stopped.
  void take_back(const std::vector<std::size_t>& motors);
  // This motor waits no more: so do those that were armed with it.
  void take_back_companions(std::size_t motor);
  void set_reference(const command_t& command);
  move_plan_t plan_of(std::int64_t now_us, const command_t& command) const;
  bool by_table(const Motor& motor, std::int64_t steps) const;
  // A motor that moves is given to another move: what it was moving or stopping for has ended.
  void take_over(std::size_t motor, const Client& by);
  // From rest; the motor is part of a move.
  void start_run(std::size_t motor, std::int64_t target, motion::Tick start);
  void log_start(Motor& motor, std::int64_t steps, motion::Tick start, std::uint32_t late_ns,
                 bool by_table);
  void stop_motors(std::int64_t now_us, const std::vector<std::size_t>& motors);
  // Lets the MCUs know what is wanted of these motors now, in place of changes that they have not
  // taken.
  void change_motors(std::int64_t now_us, const std::vector<std::size_t>& motors);
  void start_pending(std::int64_t now_us, const command_t& command);
  void emergency_stop(Pending& pending);
  bool stopping_all() const;  // an EMERGENCY_STOP has no result yet
  std::string follow_emergency_stop(Pending& pending,
                                    std::int64_t now_us) const;  // a failure, or ""
  void check_pending(std::int64_t now_us, std::optional<std::size_t> reported_mcu);
  std::string still_wrong(const Pending& pending, const Mcu& mcu) const;
  void finish_pending(const Pending& pending, const std::string& failure);
  void answer(const Client& client, std::int8_t phase, const std::string& result,
              const std::string& reason, reply_t reply = {});

  // homing.cpp
  bool is_homing(std::size_t motor) const;            // or waits for it
  bool is_moved_locally(std::size_t motor) const;     // by the inputs at its MCU
  bool is_moving(std::size_t motor) const;            // by whatever
  bushd_home home_command(const Motor& motor) const;  // precondition: it has a home
  std::string refuse_homing(std::size_t motor) const;
  void start_homing(const command_t& command);
  void queue_homing(std::size_t motor);
  void begin_homing(Mcu& mcu);
  void follow_homing(Mcu& mcu);
  void refuse_home(Mcu& mcu, std::uint8_t status);
  void stop_homing(std::size_t motor);
  // It ends if its MCU has not been asked yet; returns whether it did.
  bool forget_waiting_homing(std::size_t motor);
  void home_at_start(Mcu& mcu);
  void end_homing(Mcu& mcu, motion::Outcome outcome, const std::string& reason);
  // All of them, without a word to the MCU.
  void end_homings(Mcu& mcu, motion::Outcome outcome, const std::string& reason);

  // tables.cpp
  std::string refuse_table_change(const command_t& command) const;
  void start_table_change(const Client& client, std::int8_t kind, const std::string& group,
                          const std::string& wanted);
  std::optional<std::size_t> find_group(const std::string& name) const;
  bushd_set_inputs inputs_of(const Mcu& mcu) const;  // limits.cpp
  link::McuSetup setup_of(const Mcu& mcu, const std::vector<InService>& service) const;
  std::string misfit(const std::vector<InService>& service, std::size_t group) const;
  std::string misfit(const std::vector<TableChange::Part>& parts) const;
  void take_part(TableChange& change, TableChange::Part part, Result<tables::TablePtr> read);
  void supersede(const TableChange& by);
  void put_in_service(std::size_t group, tables::TablePtr table);
  const TableChange* changing(std::size_t mcu) const;
  std::vector<std::size_t> mcus_of(const std::vector<TableChange::Part>& parts) const;
  bool unchanged(const TableChange::Part& part) const;
  bool ready_for_change(const TableChange& change) const;
  void begin_upload(std::int64_t now_us, TableChange& change);
  std::int64_t upload_us(const Mcu& mcu) const;
  bool uploaded(const TableChange& change) const;
  void roll_back(TableChange& change);
  void keep(TableChange& change);
  void follow_table_changes(std::int64_t now_us);
  void finish_table_change(std::list<TableChange>::iterator change, std::int8_t phase,
                           const std::string& result, std::string reason);

  // snapshot.cpp
  void publish();
  state_t state_of(const Mcu& mcu) const;
  const char* activity_of(std::size_t motor) const;

  // health.cpp
  void watch_for_other_masters(std::int64_t now_us);
  void publish_health();
  health_t health_of(const Bus& bus, const config::Bus& config) const;
  mcu_health_t health_of(const Mcu& mcu) const;

  const config::Config& config_;
  Outputs& outputs_;
  std::vector<InService> service_;  // by group
  std::vector<std::unique_ptr<Bus>> buses_;
  std::vector<Mcu> mcus_;
  std::vector<Motor> motors_;
  std::unordered_map<std::string, std::size_t> motor_by_name_;
  motion::MoveBook book_;
  std::unordered_map<std::uint64_t, OpenMove> open_moves_;  // by number in book_
  std::list<Pending> pending_;
  std::list<TableChange> table_changes_;
  std::uint64_t last_ticket_ = 0;
  ClientLog clients_;
  std::uint64_t rejected_commands_ = 0;
  std::uint64_t last_log_id_ = 0;
  std::int64_t sequence_ = 0;
  std::int64_t state_due_us_ = 0;
  std::int64_t state_sent_us_ = INT64_MIN / 2;
  std::int64_t health_sequence_ = 0;
  std::int64_t health_due_us_ = 0;
  bool changed_ = true;
  bool shutting_down_ = false;
};

}  // namespace bushd::daemon
