// What the services see of the world: buses, MCUs and motors, each found by its own kind of id.
// Which place an MCU has in its bus's master is known here only.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "api/request.h"
#include "base/by_id.h"
#include "base/ids.h"
#include "base/result.h"
#include "bus/rs485/bus_master.h"
#include "config/config.h"
#include "daemon/model/bus_kinds.h"
#include "daemon/model/mcu_setup.h"
#include "motion/motor.h"
#include "tables/gentler.h"

namespace bushd::daemon {

class Installation;

// Answers the master's question what motors shall do.
class AxisSource : public link::TickSource {
 public:
  // Null where no motor is or where it has no plan.
  virtual motion::Axis* axis_of(link::McuIndex mcu, Output output) = 0;

  std::uint16_t render(link::McuIndex mcu, std::uint8_t motor, link::Tick first, unsigned count,
                       std::int16_t* out, std::size_t stride) final;
  std::optional<RunSegment> run_at(link::McuIndex mcu, std::uint8_t motor, link::Tick first,
                                   unsigned max_ticks) final;
  std::optional<bushd_run> plan_at(link::McuIndex mcu, std::uint8_t motor, link::Tick at) final;
  std::optional<link::MotorPlan> plan_on_line_at(link::McuIndex mcu, std::uint8_t motor,
                                                 link::Tick at) final;
  link::Tick end_tick(link::McuIndex mcu, std::uint8_t motor) final;
};

class Bus final : public AxisSource {
 public:
  Bus(const config::Bus& as_configured, link::BusSetup setup, Installation& of)
      : config(as_configured),
        installation_(of),
        master_(new_master(as_configured, std::move(setup), *this)),
        master(*master_),
        offers(master.offers()) {}

  motion::Axis* axis_of(link::McuIndex mcu, Output output) override;
  // Kinds that nothing answers unasked take their port for the right one.
  bool heard() const { return offers.shared_line == nullptr || offers.shared_line->heard(); }
  bool hears_two_masters(std::int64_t now_us) const {
    return offers.shared_line != nullptr && offers.shared_line->two_masters(now_us);
  }

  const config::Bus& config;

 private:
  Installation& installation_;
  const std::unique_ptr<link::BusMaster> master_;

 public:
  link::BusMaster& master;
  const link::Offers offers;
  std::vector<McuId> mcus;  // by link::McuIndex
  std::string port_state = "not yet opened";
  std::string port;          // that is open; "": none
  bool two_masters = false;  // as told in the log last
};

// One MCU, and what is known of it. What is asked of it is asked of its bus, by its place there.
class Mcu {
 public:
  Mcu(McuId its_id, const config::Mcu& as_configured, Bus& bus, link::McuIndex on_bus)
      : id(its_id),
        config(as_configured),
        offers(bus.offers),
        master_(bus.master),
        on_bus_(on_bus) {}

  const McuId id;
  const config::Mcu& config;
  const link::Offers offers;  // of its bus
  const std::string& name() const { return config.id; }
  const std::vector<MotorId>& motors() const { return motors_; }  // in the order of outputs
  std::optional<MotorId> motor_at(Output output) const { return motor_at_[output.value]; }
  link::McuIndex on_bus() const { return on_bus_; }
  link::BusMaster& bus() { return master_; }
  const link::BusMaster& bus() const { return master_; }

  const link::McuView& view() const { return master_.view(on_bus_); }
  const bushd_report& report() const { return view().report; }
  bool online() const { return view().phase == link::McuPhase::kOnline; }
  bool offline() const { return view().phase == link::McuPhase::kOffline; }
  Result<void> must_be_online() const;
  // It has not yet answered all that it was asked, or not yet reported since.
  bool busy() const { return master_.busy(on_bus_); }
  // Its drivers are disabled at rest (IdleDrivers), and enabled when one of its motors is to move.
  bool asleep = false;

  // What its identity tells that it can: preconditions of what its bus offers.
  bool can_run_tables() const { return can(BUSHD_CAN_TABLE_RUN); }
  bool can_run_slowly() const { return can(BUSHD_CAN_SLOW_RUNS); }
  bool can_trigger() const { return can(BUSHD_CAN_TRIGGER); }
  bool can_arm_lines() const { return can_trigger() && can(BUSHD_CAN_LINE_RUN); }
  bool can_compare_positions() const {
    return offers.requests != nullptr && can(BUSHD_CAN_POSITION_COMPARE);
  }
  bool can_travel() const { return can(BUSHD_CAN_TRAVEL); }
  bool can_home() const { return can(BUSHD_CAN_HOME); }
  bool can_have_program() const { return offers.programs != nullptr && can(BUSHD_CAN_PROGRAM); }

  // As link::LineRuns and link::Uploads say; of a bus without them the answer is no.
  std::optional<std::uint8_t> bank_of(const bushd_table& table) const {
    if (offers.line_runs == nullptr) return std::nullopt;
    return offers.line_runs->bank_of(on_bus_, table);
  }
  bool has_table(const bushd_table& table) const { return bank_of(table).has_value(); }
  bool makes_lines() const {
    return offers.line_runs != nullptr && offers.line_runs->makes_lines(on_bus_);
  }
  bool makes_elementary_lines() const { return makes_lines() && can(BUSHD_CAN_ELEMENTARY); }
  bool keeps_up_with(const bushd_table& table, bushd_delay shortest_delay, bool alone) const {
    return offers.line_runs != nullptr &&
           offers.line_runs->keeps_up_with(on_bus_, table, shortest_delay, alone);
  }
  bool can_run_line(const bushd_table& table, bushd_delay shortest_delay, bool alone) const {
    return offers.line_runs != nullptr &&
           offers.line_runs->can_run_line(on_bus_, table, shortest_delay, alone);
  }
  bool can_upload(const bushd_table& table) const {
    return offers.uploads != nullptr && offers.uploads->can_upload(on_bus_, table);
  }
  bool uploads() const { return offers.uploads != nullptr && offers.uploads->uploads(on_bus_); }

  link::Tick earliest_start(std::int64_t now_us, Output output) const {
    return master_.earliest_start(now_us, on_bus_, output.value);
  }
  // The run of a motor's share that the MCUs are to make themselves, in so many ticks.
  // Precondition: can_run_line of its line, or its table is yet to be uploaded.
  link::LineRun line_run(const motion::LineShare& share, bushd_delay shortest_delay,
                         link::Tick ticks) const;
  link::LineRun line_run(const motion::Axis& axis) const {
    return line_run(*axis.line(), axis.shortest_delay(), axis.over_tick() - axis.start_tick());
  }
  link::ToReplace to_replace(std::uint16_t outputs) const {
    return {.mcu = on_bus_, .motors = outputs};
  }
  Result<void> has_room(const link::McuSetup& setup) const;

 private:
  friend class Installation;
  bool can(std::uint32_t capability) const { return master_.can(on_bus_, capability); }

  link::BusMaster& master_;
  link::McuIndex on_bus_;
  std::vector<MotorId> motors_;
  std::array<std::optional<MotorId>, BUSHD_MOTORS_PER_MCU> motor_at_{};
};

class Installation {
 public:
  // The configuration outlives it. `master` tells this daemon from others on the same lines.
  Installation(const config::Config& config, std::uint16_t master);
  Installation(const Installation&) = delete;
  Installation& operator=(const Installation&) = delete;

  const config::Config& config() const { return config_; }
  // Currents and velocities as they are now. What is put has yet to be told to the MCU.
  const Drives& drives() const { return drives_; }
  // People at an MCU move some motor, so that it is worth asking which.
  bool any_moved_by_people() const { return moved_by_people_ != 0; }
  // Precondition: the motor has no plan; has_table().
  void put(MotorId motor, const config::Drive& drive);
  link::McuSetup setup_of(McuId mcu) const { return setup_of(mcu, tables_, drives_); }
  // Precondition: has_table() of its motors.
  link::McuSetup setup_of(McuId mcu, const Tables& tables, const Drives& drives) const;
  // Whether the motor could go by its share of this table.
  Result<void> has_table(MotorId motor, const Tables& tables, const Drives& drives) const;

  Bus& operator[](BusId id) { return *buses_[id]; }
  const Bus& operator[](BusId id) const { return *buses_[id]; }
  Mcu& operator[](McuId id) { return mcus_[id]; }
  const Mcu& operator[](McuId id) const { return mcus_[id]; }
  motion::Motor& operator[](MotorId id) { return motors_[id]; }
  const motion::Motor& operator[](MotorId id) const { return motors_[id]; }
  auto buses() const { return buses_.ids(); }
  auto mcus() const { return mcus_.ids(); }
  auto motors() const { return motors_.ids(); }

  Mcu& mcu_of(MotorId id) { return mcus_[config_[id].mcu]; }
  const Mcu& mcu_of(MotorId id) const { return mcus_[config_[id].mcu]; }
  const Bus& bus_of(const Mcu& mcu) const { return *buses_[mcu.config.bus]; }
  std::vector<McuId> mcus_of(const std::vector<MotorId>& motors) const;  // each once, in order
  // With those that move on a line with one of them.
  std::vector<MotorId> with_lines(std::vector<MotorId> motors) const;
  // What an MCU with `ready = "after-homing"` waits for: its motors with a home that it has not
  // homed since it booted.
  std::vector<MotorId> to_be_homed(const Mcu& mcu) const;
  bool any_moves(const Mcu& mcu) const;  // or is not at rest
  bool rests(const Mcu& mcu) const;      // all of it, as planned and as reported
  // The MCU gets such a move as a whole and runs it by the motor's table.
  bool by_table(const Mcu& mcu, std::int64_t steps, bushd_delay shortest_delay) const;

  // By the names that clients use; none of them twice.
  Result<MotorId> find(const std::string& name) const;
  // The names of motors and computed axes, or those of groups.
  std::vector<std::string_view> names(bool of_groups) const;
  Result<std::vector<MotorId>> find(const api::MotorNames& names) const;
  Result<std::vector<MotorId>> find(const std::vector<api::MotorAmount>& motors) const;
  Result<std::vector<MotorId>> find_or_all(const api::MotorNames& names) const;  // none named: all
  // Motors, or those of groups, each once; none named: all.
  Result<std::vector<MotorId>> find_with_groups(const api::MotorNames& names) const;
  // The motors as far as there are such, or groups where these may be named: for what ends motion,
  // which does what it can. None named: all.
  struct Known {
    std::vector<MotorId> motors{};
    std::string unknown{};  // what is said of the other names; "": there are none
  };
  Known find_known(const api::MotorNames& names, bool groups) const;
  // The MCUs of these motors that are not online: " hall:1 hall:2". "": none.
  std::string not_online(const std::vector<MotorId>& motors) const;

  const Tables& tables() const { return tables_; }
  // By which it goes: that of its group, or its share of that. Lives as long as this.
  tables::TablePtr table_of(MotorId id) const { return table_of(id, tables_, drives_); }
  // Precondition: none of the group's motors has a plan. MCUs are set up by the caller.
  void put_in_service(GroupId group, tables::TablePtr table);
  motion::Axis new_axis(MotorId id) const;

  // Something that clients see is not what was published last.
  bool changed = true;
  bool shutting_down = false;  // nothing new is begun

 private:
  tables::TablePtr table_of(MotorId id, const Tables& tables, const Drives& drives) const;
  void add_buses(std::uint16_t master);
  void add_mcus();
  void add_motors();

  const config::Config& config_;
  Drives drives_;
  std::size_t moved_by_people_ = 0;
  Tables tables_;  // in service
  mutable tables::Gentler gentler_;
  ById<BusId, std::unique_ptr<Bus>> buses_;
  ById<McuId, Mcu> mcus_;
  ById<MotorId, motion::Motor> motors_;
  std::unordered_map<std::string, MotorId> motor_by_name_;
};

}  // namespace bushd::daemon
