// Whether the positions that the daemon calls known are right, at all times: while motors move as
// well as at rest.
//
// What must hold. Let T be the tick of a state: that which the MCU was emitting when it made the
// report behind this state. Let P(T) be the motor's pulses, forward minus backward, before the
// beginning of T by this MCU's own timer; a step in T's first slot is made at its beginning, and so
// comes after it. Then, for each motor of an MCU that is online,
//
//     position_steps  =  P(T) - offset                                      exactly, to the step
//
// The offset is that between the motor and the MCU's counter. It changes only at rest and only by
// what somebody asked for: by SET_POSITION, when the counter takes another value; by homing, when
// it is counted from the switch, to one step; and by the end of a reset, from which the counter
// begins at 0; where positions are kept, it is set then to where the motor stood, or the position
// is neither known nor restored until somebody says where it stands, or confirms what is shown.
// What is restored must be as right as what is known. So a state may lag behind the motor by the
// age of its report, and by nothing else; and this age is bounded too: an MCU that has not answered
// for kMaxAgeNs of the daemon's time is not online any more. A motor that is said to be at rest
// stands there now, not only at T. And a motor that an emergency stop has stopped immediately in
// motion is not called known by the daemon that was there, from the first report after that until
// somebody says where it stands, or homes it.
//
// Where T's pulses are taken from: the poll as the MCU hears it (Overheard), for it makes its
// report at once. Of the firmware only its tick's number and beginning are used.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "api/snapshot.h"
#include "config/config.h"
#include "sim/bus.h"
#include "sim/plant.h"

namespace bushfaults {

// What must be right.
bool is_good(bushd::api::Trust trust);

class Positions {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // All of them outlive it.
  Positions(const bushd::config::Config& config, const bushd::sim::Bus& bus,
            const bushd::sim::Plant& plant);

  // What is called known (or restored) must be where the motor stands now, also while its MCU is
  // not online.
  void be_strict(bool strict) { strict_ = strict; }
  // Positions are kept over restarts and power cuts: what people have said where motors stand
  // counts until they say otherwise, whatever happens to daemons and MCUs.
  void keep() { kept_ = true; }
  // The MCU makes a report now.
  void reported(TimeNs now_ns, std::size_t mcu);
  void mcu_reset(std::size_t mcu);
  void daemon_started();

  // Somebody may set the motor's position to this one, now that it rests, and perhaps nobody is
  // ever told.
  void may_be_set(std::size_t motor, std::int64_t position_steps);
  // Wherever it is shown now, that is where it stands.
  void may_be_confirmed(std::size_t motor) {
    motors_[motor].perhaps_confirmed = true;
    motors_[motor].cut_off_ns.reset();
  }
  void may_be_homed(std::size_t motor) { motors_[motor].perhaps_homed = true; }
  // It is, and has not been moved since.
  void homed(std::size_t motor, std::int64_t position_steps);
  // It was, and perhaps has been moved since. What is wrong with that, if something is.
  std::optional<std::string> was_homed(std::size_t motor, std::int64_t position_steps);
  // Where the plant has the motor's switch.
  void has_switch(std::size_t motor, std::int64_t at_steps);
  void cut_off(TimeNs now_ns, std::size_t mcu, std::size_t output);
  void was_set(std::size_t motor, std::int64_t position_steps);

  // The daemon does nothing until then; that may come while it does nothing already.
  void pause(TimeNs now_ns, TimeNs until_ns);

  // What is wrong with what a state says, if something is.
  std::optional<std::string> check(TimeNs now_ns, std::size_t mcu,
                                   const bushd::api::StateSnapshot& state);

  // Where the motor stands, and what the daemon's positions are less than that; nothing while no
  // position of its is known.
  std::int64_t plant_steps(std::size_t motor) const;
  std::optional<std::int64_t> offset(std::size_t motor) const { return motors_[motor].offset; }
  // The oldest report that was behind a state of an MCU online.
  TimeNs worst_age_ns() const { return worst_age_ns_; }

 private:
  static constexpr std::int64_t kHomeSteps = 1;  // how exactly a switch is found
  struct Motor {
    std::optional<std::int64_t> offset = 0;
    struct Set {
      std::int64_t position_steps;
      std::int64_t offset;  // if it takes effect where the motor stood when it was asked for
    };
    std::vector<Set> perhaps_set;
    std::optional<std::int64_t> home_offset;  // that between switch and `home`
    bool perhaps_homed = false;
    bool perhaps_confirmed = false;  // no claim since
    std::optional<TimeNs> cut_off_ns;

    bool at_home(std::int64_t pulses, std::int64_t position_steps) const {
      return perhaps_homed && std::abs(pulses - position_steps - *home_offset) <= kHomeSteps;
    }
  };
  struct Report {
    TimeNs made_ns;
    TimeNs paused_ns;  // of the daemon, until then
    std::uint16_t boot_number;
    std::uint32_t tick;
    std::array<std::int64_t, BUSHD_MOTORS_PER_MCU> pulses;  // by output
  };

  TimeNs paused_by_ns(TimeNs now_ns) const;
  std::optional<std::string> check_offline(const bushd::api::StateSnapshot& state) const;
  std::optional<std::string> check_age(TimeNs now_ns, std::size_t mcu, const Report& report);
  std::optional<std::string> check_motor(std::size_t mcu, const bushd::api::MotorState& claim,
                                         const Report& report);
  void follow_set(const bushd::api::MotorState& claim, const Report& report);
  static bool agrees(Motor& motor, std::int64_t position_steps, std::int64_t pulses);

  const bushd::config::Config& config_;
  const bushd::sim::Bus& bus_;
  const bushd::sim::Plant& plant_;
  std::vector<Motor> motors_;
  std::vector<std::deque<Report>> reports_;    // by MCU, oldest first
  std::vector<std::optional<int>> boot_seen_;  // by MCU: that this daemon has dealt with
  TimeNs paused_ns_ = 0;                       // in all, until paused_until_ns_
  TimeNs paused_until_ns_ = 0;
  TimeNs worst_age_ns_ = 0;
  bool strict_ = false;
  bool kept_ = false;
};

}  // namespace bushfaults
