// Requests to one MCU, made in this order, each acknowledged before the next: the setup of an MCU
// that connects, and what is asked of it later.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "bus/rs485/bus_setup.h"
#include "engine/message.h"

namespace bushd::link {

class SetupQueue {
 public:
  struct Request {
    std::uint8_t type;
    std::vector<std::uint8_t> payload;

    std::size_t reply_payload() const {
      if (type == BUSHD_MSG_PROGRAM_STATE) return BUSHD_PROGRAM_STATE_SIZE;
      return type == BUSHD_MSG_TABLES ? BUSHD_TABLES_SIZE : 1;
    }
  };

  bool empty() const { return requests_.empty(); }
  const Request& front() const { return requests_.front(); }
  void clear() { requests_.clear(); }
  // Another setup follows, which says all that this one would have. What was asked otherwise stays;
  // so does CONTROL, which may be either, and does no harm twice.
  void discard_setup();
  // Whether a setup has such requests, among others.
  static bool may_be_setup(std::uint8_t type);
  // The first request has been answered, if it is of this type. Returns false if it is not.
  bool done(std::uint8_t type);

  void configure(const bushd_configure& message);
  void emission(const bushd_emission& message);
  void outputs(const bushd_set_outputs& message);
  void inputs(const bushd_set_inputs& message);
  void motor_inputs(const bushd_motor_inputs& message);
  void currents(const bushd_currents& message);
  void velocity(const bushd_set_velocity& message);
  void local(const bushd_local& message);
  // Which tables it has.
  void ask_for_tables();
  void upload_table(std::uint8_t bank, const TableRef& ref);
  void assign(std::uint8_t motor, std::uint8_t bank);

  void control(const bushd_control& message);
  // What was asked before an emergency stop must not clear it.
  void discard_clearing();
  void set_position(std::uint8_t motor, std::int32_t position_steps);
  void home(const bushd_home& message);
  void travel(const bushd_travel& message);
  void position_compare(const bushd_position_compare& message);
  // `entries` by rising motor.
  void arm(std::uint8_t number, bushd_edge edge, std::uint32_t delay_us,
           std::span<const bushd_table_run_entry> entries);
  void arm_line(const bushd_line_trigger& message, std::span<const bushd_line_entry> entries);
  void disarm();

 private:
  template <class Encode>
  void add(std::uint8_t type, Encode encode);

  std::deque<Request> requests_;
};

}  // namespace bushd::link
