#include "bus/rs485/setup_queue.h"

#include <algorithm>
#include <utility>

namespace bushd::link {

template <class Encode>
void SetupQueue::add(std::uint8_t type, Encode encode) {
  Request request{.type = type, .payload = std::vector<std::uint8_t>(BUSHD_FRAME_MAX_PAYLOAD)};
  request.payload.resize(encode(request.payload.data()));
  requests_.push_back(std::move(request));
}

bool SetupQueue::done(std::uint8_t type) {
  if (requests_.empty() || requests_.front().type != type) return false;
  requests_.pop_front();
  return true;
}

bool SetupQueue::may_be_setup(std::uint8_t type) {
  switch (type) {
    case BUSHD_MSG_SET_POSITION:
    case BUSHD_MSG_HOME:
    case BUSHD_MSG_TRAVEL:
    case BUSHD_MSG_TRIGGER:
    case BUSHD_MSG_LINE_TRIGGER:
    case BUSHD_MSG_POSITION_COMPARE:
      return false;
    default:
      return true;
  }
}

void SetupQueue::discard_setup() {
  std::erase_if(requests_, [](const Request& request) {
    return may_be_setup(request.type) && request.type != BUSHD_MSG_CONTROL;
  });
}

void SetupQueue::configure(const bushd_configure& message) {
  add(BUSHD_MSG_CONFIGURE, [&](std::uint8_t* p) { return bushd_encode_configure(&message, p); });
}

void SetupQueue::emission(const bushd_emission& message) {
  add(BUSHD_MSG_EMISSION, [&](std::uint8_t* p) { return bushd_encode_emission(&message, p); });
}

void SetupQueue::outputs(const bushd_set_outputs& message) {
  add(BUSHD_MSG_OUTPUTS, [&](std::uint8_t* p) { return bushd_encode_set_outputs(&message, p); });
}

void SetupQueue::inputs(const bushd_set_inputs& message) {
  add(BUSHD_MSG_INPUTS, [&](std::uint8_t* p) { return bushd_encode_set_inputs(&message, p); });
}

void SetupQueue::motor_inputs(const bushd_motor_inputs& message) {
  add(BUSHD_MSG_MOTOR_INPUTS,
      [&](std::uint8_t* p) { return bushd_encode_motor_inputs(&message, p); });
}

void SetupQueue::currents(const bushd_currents& message) {
  add(BUSHD_MSG_CURRENTS, [&](std::uint8_t* p) { return bushd_encode_currents(&message, p); });
}

void SetupQueue::velocity(const bushd_set_velocity& message) {
  add(BUSHD_MSG_VELOCITY, [&](std::uint8_t* p) { return bushd_encode_set_velocity(&message, p); });
}

void SetupQueue::local(const bushd_local& message) {
  add(BUSHD_MSG_LOCAL, [&](std::uint8_t* p) { return bushd_encode_local(&message, p); });
}

void SetupQueue::ask_for_tables() {
  requests_.push_back({.type = BUSHD_MSG_TABLES, .payload = {}});
}

void SetupQueue::upload_table(std::uint8_t bank, const TableRef& ref) {
  const bushd_table& table = *ref.table;
  const bool symmetric = table.decel.code == table.accel.code;
  std::vector<std::uint16_t> codes(table.accel.code, table.accel.code + table.accel.count);
  if (!symmetric) {
    codes.insert(codes.end(), table.decel.code, table.decel.code + table.decel.count);
  }
  const bushd_table_begin begin = {
      .bank = bank,
      .accel_count = static_cast<std::uint16_t>(table.accel.count),
      .decel_count = static_cast<std::uint16_t>(symmetric ? 0 : table.decel.count),
      .cruise = table.cruise,
      .time_unit_ns = table.time_unit_ns,
      .revision = ref.revision};
  add(BUSHD_MSG_TABLE_BEGIN, [&](std::uint8_t* p) { return bushd_encode_table_begin(&begin, p); });
  for (std::size_t at = 0; at < codes.size(); at += BUSHD_TABLE_DATA_MAX_CODES) {
    const auto count = static_cast<std::uint8_t>(
        std::min<std::size_t>(codes.size() - at, BUSHD_TABLE_DATA_MAX_CODES));
    add(BUSHD_MSG_TABLE_DATA, [&](std::uint8_t* p) {
      return bushd_encode_table_data(bank, static_cast<std::uint16_t>(at), count, &codes[at], p);
    });
  }
  const bushd_table_end end = {.bank = bank, .crc = bushd_table_crc32(&table)};
  add(BUSHD_MSG_TABLE_END, [&](std::uint8_t* p) { return bushd_encode_table_end(&end, p); });
}

void SetupQueue::assign(std::uint8_t motor, std::uint8_t bank) {
  const bushd_assign message = {motor, bank};
  add(BUSHD_MSG_ASSIGN, [&](std::uint8_t* p) { return bushd_encode_assign(&message, p); });
}

void SetupQueue::control(const bushd_control& message) {
  add(BUSHD_MSG_CONTROL, [&](std::uint8_t* p) { return bushd_encode_control(&message, p); });
}

void SetupQueue::discard_clearing() {
  for (Request& request : requests_) {
    if (request.type != BUSHD_MSG_CONTROL) continue;
    request.payload.resize(1);  // without the faults
    request.payload[0] &= static_cast<std::uint8_t>(~BUSHD_CONTROL_CLEAR_FAULTS);
  }
}

void SetupQueue::set_position(std::uint8_t motor, std::int32_t position_steps) {
  const bushd_set_position message = {motor, position_steps};
  add(BUSHD_MSG_SET_POSITION,
      [&](std::uint8_t* p) { return bushd_encode_set_position(&message, p); });
}

void SetupQueue::home(const bushd_home& message) {
  add(BUSHD_MSG_HOME, [&](std::uint8_t* p) { return bushd_encode_home(&message, p); });
}

void SetupQueue::travel(const bushd_travel& message) {
  add(BUSHD_MSG_TRAVEL, [&](std::uint8_t* p) { return bushd_encode_travel(&message, p); });
}

void SetupQueue::position_compare(const bushd_position_compare& message) {
  add(BUSHD_MSG_POSITION_COMPARE,
      [&](std::uint8_t* p) { return bushd_encode_position_compare(&message, p); });
}

void SetupQueue::arm(std::uint8_t number, bushd_edge edge, std::uint32_t delay_us,
                     std::span<const bushd_table_run_entry> entries) {
  add(BUSHD_MSG_TRIGGER, [&](std::uint8_t* p) {
    return bushd_encode_trigger(number, edge, delay_us, entries.data(),
                                static_cast<std::uint8_t>(entries.size()), p);
  });
}

void SetupQueue::arm_line(const bushd_line_trigger& message,
                          std::span<const bushd_line_entry> entries) {
  add(BUSHD_MSG_LINE_TRIGGER, [&](std::uint8_t* p) {
    return bushd_encode_line_trigger(&message, entries.data(),
                                     static_cast<std::uint8_t>(entries.size()), p);
  });
}

void SetupQueue::disarm() {
  add(BUSHD_MSG_TRIGGER,
      [](std::uint8_t* p) { return bushd_encode_trigger(0, BUSHD_EDGE_NONE, 0, nullptr, 0, p); });
}

}  // namespace bushd::link
