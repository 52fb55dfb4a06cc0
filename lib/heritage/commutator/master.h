// A commutator board as a bus: one MCU with eight motors, of which one moves at a time. The board
// has neither ticks nor reports: what it answers to each delay code is made into the reports that
// link::BusMaster asks for.
//
// Ticks stand still while a step takes longer than the plan has it, because of the line and of this
// program's pauses, and go on when it has been answered. So the reported tick is always one by
// which the plan has made no more steps than the motor has, and what is planned from a tick on is
// planned from a step on.
//
// A pause at speed that lets the motor stand (longer than the first delay of its table) makes its
// position uncertain, and from there it speeds up by its table again.
//
// A step without an answer, or a supply or motor that the board misses, ends the motion and takes
// the MCU off line for a while; the motor's position is then uncertain by one step, or by what an
// unpowered motor does, and that is said. A board says nothing unless it is asked for a step, so it
// is taken for on line as long as its port is open.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bus/rs485/bus_master.h"
#include "bus/rs485/tick_source.h"
#include "heritage/commutator/exchange.h"
#include "heritage/commutator/planned_steps.h"

namespace bushd::commutator {

class CommutatorMaster final : public link::BusMaster {
 public:
  struct Setup {
    std::string name;  // tells its board from others, for what is kept of positions
    Exchange::Setup board{};
  };
  // `source` outlives it. Preconditions: the setup has one MCU, with outputs 0..7.
  CommutatorMaster(Setup setup, link::BusSetup bus, link::TickSource& source);

  link::Offers offers() override { return {.one_at_a_time = true}; }

  void port_opened(std::int64_t now_us) override;
  void port_lost(std::int64_t now_us, const std::string& cause) override;
  void receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) override;
  std::span<const std::uint8_t> step(std::int64_t now_us) override;
  std::int64_t next_wake_us() const override;
  std::vector<link::Event> take_events() override;

  const link::McuView& view(link::McuIndex) const override { return board_.view; }
  bool time_known() const override { return port_open_; }
  link::Tick tick_at(std::int64_t now_us) const override { return plan_ns(now_us) / tick_ns_; }
  const link::McuHealth& health(link::McuIndex) const override { return board_.health; }
  const link::BusHealth& bus_health() const override { return health_; }
  bool busy(link::McuIndex) const override { return report_wanted_; }

  link::Tick earliest_start(std::int64_t now_us, link::McuIndex mcu,
                            std::uint8_t motor) const override;
  link::Tick earliest_replace(std::int64_t now_us,
                              std::span<const link::ToReplace> together) const override;
  link::Tick earliest_retarget(std::int64_t now_us, std::span<const link::ToReplace> together,
                               link::Tick start) const override;
  void begin(link::McuIndex mcu, std::uint8_t motor, link::Tick start) override;
  void replace(link::McuIndex mcu, std::uint16_t motors, link::Tick first) override;
  void drop(link::McuIndex mcu, std::uint8_t motor) override;
  void emergency_stop(bushd_stop_mode mode) override;
  void bind_to_stop(link::McuIndex, bushd_stop_mode mode) override { emergency_stop(mode); }

  void reconfigure(link::McuIndex mcu, link::McuSetup setup) override;
  // Refuses a table with steps that come sooner than the board can make them: sooner than one delay
  // code, or than a period of its converter.
  Result<void> check_room(link::McuIndex mcu, const link::McuSetup& setup) const override;
  void control(link::McuIndex mcu, std::uint8_t actions) override;
  void set_position(link::McuIndex mcu, std::uint8_t motor, std::int32_t position_steps) override;

 private:
  struct Motion {
    std::uint8_t motor;
    PlannedSteps steps;
    std::optional<PlannedSteps::Step> asked{};  // of the board
    bool cut = false;                           // no step more
    // The code sent last, and the interval between its step and the one before.
    std::int64_t sent_us = 0;
    std::uint64_t delay_ns = 0;
    std::uint64_t interval_ns = UINT64_MAX;
    std::uint32_t steps_since_pause = UINT32_MAX;
  };

  std::int64_t plan_ns(std::int64_t now_us) const;
  std::int64_t us_of_plan(std::int64_t plan_ns) const;
  void set_clock(std::int64_t now_us, std::int64_t plan_ns);
  void handle(std::int64_t now_us, const Exchange::Event& event);
  void answered(std::int64_t now_us, const Status& status);
  void set_powered(bool on);
  void lost(std::int64_t now_us, const std::string& cause);
  void take_limits(const Status& status, std::uint8_t motor);
  void ask(std::int64_t now_us);
  std::uint64_t paced(std::int64_t now_us, std::uint64_t delay_ns);
  void leave_plan();
  void cut();
  void end_motion();
  void uncertain(std::uint8_t motor, std::string reason);
  void go_offline(std::int64_t now_us, std::string detail);
  void go_online(std::int64_t now_us);
  void take_report(std::int64_t now_us);

  const std::int64_t tick_ns_;
  const bool has_converter_;
  const std::int64_t settle_us_;  // a code of the board's that nobody waits for is over by then
  link::TickSource& source_;
  link::McuRecord board_;
  link::BusHealth health_;
  Exchange exchange_;
  std::vector<link::Event> events_;
  std::vector<std::uint8_t> out_;
  bool port_open_ = false;
  std::optional<std::int64_t> online_us_;  // when to go online
  bool report_wanted_ = false;
  std::int64_t report_us_ = 0;  // the next one at the latest
  std::int64_t clock_us_ = 0;   // the plan's time at clock_ns_
  std::int64_t clock_ns_ = 0;
  std::array<std::int64_t, kMotors> position_{};
  std::optional<Motion> motion_;
  std::vector<PlannedSteps::Step> recent_;  // made by its plan, in a tick that is not over
  std::uint8_t recent_motor_ = 0;
};

}  // namespace bushd::commutator
