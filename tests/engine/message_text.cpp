#include "engine/message_text.h"

#include <cstdint>
#include <initializer_list>
#include <type_traits>

#include "engine/message.h"

namespace bushd::test {
namespace {

class Fields {
 public:
  template <class T>
  Fields& add(const char* name, T value) {
    return add_text(name, std::to_string(static_cast<int64_t>(value)));
  }
  Fields& add_list(const char* name, const uint8_t* data, size_t count, size_t width) {
    std::string list;
    for (size_t i = 0; i < count; ++i) {
      const int value = width == 1 ? data[i] : bushd_get_u16(data + 2 * i);
      list += (i > 0 ? ":" : "") + std::to_string(value);
    }
    return add_text(name, list);
  }
  Fields& add_text(const char* name, const std::string& value) {
    text_ += std::string(" ") + name + "=" + value;
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

// The numbers of one element of a list.
std::string parts(std::initializer_list<int64_t> values) {
  std::string text;
  for (const int64_t value : values) text += (text.empty() ? "" : "/") + std::to_string(value);
  return text;
}

void append(std::string* list, const std::string& element) {
  *list += (list->empty() ? "" : ":") + element;
}

void put(const bushd_identify& m, Fields& f) {
  f.add("salt", m.salt).add("windows", m.windows).add("window_units", m.window_units);
}
void put(const bushd_identity& m, Fields& f) {
  f.add("protocol_version", m.protocol_version).add("motors", m.motors);
  f.add("firmware_version", m.firmware_version).add("boot_number", m.boot_number);
  f.add("slots", m.slots).add("queue_ticks", m.queue_ticks).add("table_codes", m.table_codes);
  f.add("capabilities", m.capabilities);
  f.add_list("unique_id", m.unique_id, BUSHD_UNIQUE_ID_SIZE, 1);
}
void put(const bushd_set_address& m, Fields& f) {
  f.add_list("unique_id", m.unique_id, BUSHD_UNIQUE_ID_SIZE, 1).add("address", m.address);
}
void put(const bushd_configure& m, Fields& f) {
  f.add("tick_ns", m.tick_ns)
      .add("format", m.format)
      .add("comm_timeout_ticks", m.comm_timeout_ticks);
}
void put(const bushd_table_begin& m, Fields& f) {
  f.add("bank", m.bank).add("accel_count", m.accel_count).add("decel_count", m.decel_count);
  f.add("cruise", m.cruise).add("time_unit_ns", m.time_unit_ns).add("revision", m.revision);
}
void put(const bushd_table_data& m, Fields& f) {
  f.add("bank", m.bank).add("offset", m.offset).add("count", m.count);
  f.add_list("codes", m.codes, m.count, 2);
}
void put(const bushd_table_end& m, Fields& f) {
  f.add("bank", m.bank).add("crc", m.crc);
}
void put(const bushd_tables& m, Fields& f) {
  unsigned valid = 0;
  std::string held;
  for (size_t i = 0; i < BUSHD_TABLE_BANKS; ++i) {
    if (m.bank[i].valid) valid |= 1u << i;
    append(&held, parts({m.bank[i].crc, m.bank[i].revision}));
  }
  f.add("valid", valid).add_text("held", held);
}
void put(const bushd_assign& m, Fields& f) {
  f.add("motor", m.motor).add("bank", m.bank);
}
void put(const bushd_control& m, Fields& f) {
  f.add("actions", m.actions);
  if (m.faults != 0) f.add("faults", m.faults);
}
void put(const bushd_set_position& m, Fields& f) {
  f.add("motor", m.motor).add("position_steps", m.position_steps);
}
void put(const bushd_set_inputs& m, Fields& f) {
  f.add("limit_positive", m.limit_positive).add("limit_negative", m.limit_negative);
  f.add("limit_immediate", m.limit_immediate).add("inverted", m.inverted);
  f.add("debounce_ticks", m.debounce_ticks).add("system_inverted", m.system_inverted);
  f.add("emergency", m.emergency).add("overcurrent", m.overcurrent);
  f.add("enable_after_watchdog", m.enable_after_watchdog);
}
void put(const bushd_motor_inputs& m, Fields& f) {
  f.add("motor", m.motor).add("positive", m.positive).add("negative", m.negative);
  f.add("home", m.home);
}
void put(const bushd_home& m, Fields& f) {
  f.add("motor", m.motor).add("direction", m.direction).add("most_steps", m.most_steps);
  f.add("shortest_delay", m.shortest_delay);
  f.add("slow_steps", m.slow_steps).add("slow_delay", m.slow_delay);
  f.add("position_steps", m.position_steps);
}
void put(const bushd_travel& m, Fields& f) {
  f.add("number", m.number).add("kind", m.kind).add("motor", m.motor);
  f.add("direction", m.direction).add("edge", m.edge).add("sensor", m.sensor);
  f.add("steps", m.steps).add("delay_us", m.delay_us).add("wait_us", m.wait_us);
}
void put(const bushd_currents& m, Fields& f) {
  f.add("motor", m.motor).add("decay", m.decay).add("ramp_ma", m.ramp_ma);
  f.add("cruise_ma", m.cruise_ma).add("hold_ma", m.hold_ma);
}
void put(const bushd_set_velocity& m, Fields& f) {
  f.add("motor", m.motor)
      .add("least", m.least)
      .add("most", m.most)
      .add("acceleration", m.acceleration);
}
void put(const bushd_set_outputs& m, Fields& f) {
  f.add("step_low", m.step_low).add("direction_low", m.direction_low).add("enabled", m.enabled);
}
void put(const bushd_program_put& m, Fields& f) {
  f.add("offset", m.offset).add("total", m.total).add_list("bytes", m.bytes, m.count, 1);
}
void put(const bushd_program_control& m, Fields& f) {
  f.add("action", m.action).add("number", m.number).add("value", m.value);
}
void put(const bushd_program_state& m, Fields& f) {
  f.add("stage", m.stage).add("reason", m.reason).add("number", m.number).add("flags", m.flags);
  f.add("motors", m.motors).add("memory", m.memory).add("size", m.size).add("crc", m.crc);
  f.add("frame", m.frame).add("point", m.point).add("repeats", m.repeats);
  f.add("start_tick", m.start_tick).add("tick", m.tick);
}
void put(const bushd_local& m, Fields& f) {
  f.add("motors", m.motors).add("keypad", m.keypad).add("keypad_ticks", m.keypad_ticks);
}
void put(const bushd_poll& m, Fields& f) {
  std::string entries;
  for (size_t i = 0; i < m.count; ++i) {
    const uint8_t* const at = m.entries + BUSHD_POLL_ENTRY * i;
    append(&entries, parts({at[0], bushd_get_u16(at + 1), at[3], at[4]}));
  }
  f.add("count", m.count).add_text("entries", entries);
}
void put(const bushd_sync& m, Fields& f) {
  f.add("master", m.master).add("sync_id", m.sync_id).add("follows", m.follows);
  f.add("follow_up_id", m.follow_up_id);
  f.add("sync_tick", m.sync_tick).add("sync_ns", m.sync_ns);
}
void put(const bushd_ticks& m, Fields& f) {
  f.add("epoch", m.epoch).add("flags", m.flags).add("first_tick", m.first_tick);
  f.add("count", m.count).add("mask", m.mask);
  f.add_list("delays", m.delays, m.motors, 2);
  const size_t width = m.flags & BUSHD_TICKS_FINE ? 2 : 1;
  f.add_list("displacements", m.displacements, width * m.motors * m.count, 1);
}
void put(const bushd_table_ticks& m, Fields& f) {
  f.add("epoch", m.epoch).add("flags", m.flags).add("first_tick", m.first_tick);
  f.add("count", m.count);
  std::string entries;
  uint16_t at = 0;
  for (bushd_table_ticks_entry entry; bushd_next_table_ticks_entry(&m, &at, &entry);) {
    const bushd_run_state& s = entry.state;
    append(&entries, parts({entry.motor, s.direction, s.cruises, s.since, s.since_ns, s.lead_delay,
                            s.accel_at, s.accel_end, s.cruise_left, s.decel_left, s.cruise}));
  }
  f.add_text("entries", entries);
}
void put_entries(const uint8_t* entries, uint8_t count, Fields& f) {
  std::string text;
  for (uint8_t i = 0; i < count; ++i) {
    const bushd_table_run_entry entry = bushd_next_table_run_entry(&entries);
    append(&text, parts({entry.motor, entry.bank, entry.direction, entry.steps,
                         static_cast<int64_t>(entry.shortest_delay)}));
  }
  f.add_text("entries", text);
}
void put(const bushd_table_run& m, Fields& f) {
  f.add("epoch", m.epoch).add("first_tick", m.first_tick);
  put_entries(m.entries, m.count, f);
}
void put_line(const bushd_line_part& line, Fields& f) {
  f.add("bank", line.bank | (line.elementary ? 0x80 : 0))
      .add("shortest_delay", line.shortest_delay)
      .add("longest", line.longest);
  f.add("from", line.from).add("steps", line.steps);
  std::string text;
  const uint8_t* at = line.entries;
  for (uint8_t i = 0; i < line.count; ++i) {
    const bushd_line_entry entry = bushd_next_line_entry(&at);
    append(&text, parts({entry.motor, entry.direction, entry.increment}));
  }
  f.add_text("entries", text);
}
void put(const bushd_line_run& m, Fields& f) {
  f.add("epoch", m.epoch).add("first_tick", m.first_tick);
  put_line(m.line, f);
}
void put(const bushd_line_trigger& m, Fields& f) {
  f.add("number", m.number).add("edge", m.edge).add("delay_us", m.delay_us);
  put_line(m.line, f);
}
void put(const bushd_trigger& m, Fields& f) {
  f.add("number", m.number).add("edge", m.edge).add("delay_us", m.delay_us);
  put_entries(m.entries, m.count, f);
}
void put(const bushd_position_compare& m, Fields& f) {
  f.add("motor", m.motor).add("arrivals", m.arrivals).add("position_steps", m.position_steps);
  f.add("delay_us", m.delay_us).add("width_us", m.width_us);
}
void put(const bushd_emergency& m, Fields& f) {
  f.add("mode", m.mode);
}
void put(const bushd_emission& m, Fields& f) {
  f.add("mode", m.mode).add("sequence", m.sequence).add("hold_current", m.hold_current);
  f.add("step_us", m.step_us).add("settle_us", m.settle_us);
  f.add("dir_setup_us", m.dir_setup_us).add("pulse_us", m.pulse_us);
}
void put_sections(const bushd_report& m, Fields& f) {
  if (m.sections & BUSHD_TELLS_BOOT) {
    f.add("reset_cause", m.reset_cause).add("failed_tests", m.failed_tests);
    f.add("motor_count", m.motor_count);
  }
  if (m.sections & BUSHD_TELLS_SYNC) {
    f.add("sync_id", m.sync_id).add("sync_tick", m.sync_tick).add("sync_ns", m.sync_ns);
    f.add("rate_ppb", m.rate_ppb);
  }
  if (m.sections & BUSHD_TELLS_INPUTS) {
    f.add("inputs", m.inputs).add("forbidden_positive", m.forbidden_positive);
    f.add("forbidden_negative", m.forbidden_negative).add("system_inputs", m.system_inputs);
  }
  if (m.sections & BUSHD_TELLS_COUNTERS) {
    f.add("bad_frames", m.bad_frames).add("rejected_frames", m.rejected_frames);
    f.add("last_rejection", m.last_rejection).add("ramp_downs", m.ramp_downs);
  }
  if (m.sections & BUSHD_TELLS_MOTION) {
    f.add("running", m.running).add("autonomous", m.autonomous);
    f.add("low_water_ticks", m.low_water_ticks).add("out_of_order", m.out_of_order);
    f.add("out_of_order_from", m.out_of_order_from).add("out_of_order_until", m.out_of_order_until);
  }
  if (m.sections & BUSHD_TELLS_AUTONOMOUS) {
    f.add("homed", m.homed).add("homing", m.homing).add("armed", m.armed);
    f.add("trigger_number", m.trigger_number).add("trigger_state", m.trigger_state);
    f.add("start_tick", m.start_tick).add("start_ns", m.start_ns);
  }
}
void put(const bushd_report& m, Fields& f) {
  f.add("state", m.state).add("faults", m.faults).add("flags", m.flags).add("epoch", m.epoch);
  f.add("boot_number", m.boot_number).add("number", m.number).add("sections", m.sections);
  f.add("motors", m.motors).add("moving", m.moving).add("current", m.current);
  f.add("tick", m.tick).add("tick_ns", m.tick_ns);
  put_sections(m, f);
  std::string motors;
  for (size_t i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    if ((m.motors >> i & 1) == 0) continue;
    append(&motors, parts({m.motor[i].position_steps, m.motor[i].known_until}));
  }
  if (m.motors != 0) f.add_text("motor", motors);
}
void put(const bushd_acknowledgement& m, Fields& f) {
  f.add("status", m.status);
}

template <class Message>
Message decoded_by(bushd_status (*)(const uint8_t*, size_t, Message*));

template <auto kDecode>
bushd_status read(const bushd_frame& frame, Fields* fields) {
  using Message = decltype(decoded_by(kDecode));
  Message message{};
  // One report alone does not say which motors there are.
  if constexpr (std::is_same_v<Message, bushd_report>) message.motor_count = BUSHD_MOTORS_PER_MCU;
  const bushd_status status = kDecode(frame.payload, frame.payload_size, &message);
  if (status == BUSHD_OK && fields != nullptr) put(message, *fields);
  return status;
}

bushd_status read_nothing(const bushd_frame& frame, Fields* /*fields*/) {
  return frame.payload_size == 0 ? BUSHD_OK : BUSHD_E_LENGTH;
}

struct Row {
  uint8_t type;
  const char* name;
  bushd_status (*read)(const bushd_frame& frame, Fields* fields);  // fields: null if not wanted
};
constexpr Row kAcknowledgement = {BUSHD_TYPE_REPLY, "acknowledgement",
                                  read<bushd_decode_acknowledgement>};
constexpr Row kRows[] = {
    {BUSHD_MSG_IDENTIFY, "identify", read<bushd_decode_identify>},
    {BUSHD_MSG_CONFIGURE, "configure", read<bushd_decode_configure>},
    {BUSHD_MSG_TABLE_BEGIN, "table_begin", read<bushd_decode_table_begin>},
    {BUSHD_MSG_TABLE_DATA, "table_data", read<bushd_decode_table_data>},
    {BUSHD_MSG_TABLE_END, "table_end", read<bushd_decode_table_end>},
    {BUSHD_MSG_ASSIGN, "assign", read<bushd_decode_assign>},
    {BUSHD_MSG_CONTROL, "control", read<bushd_decode_control>},
    {BUSHD_MSG_SET_POSITION, "set_position", read<bushd_decode_set_position>},
    {BUSHD_MSG_POLL, "poll", read<bushd_decode_poll>},
    {BUSHD_MSG_SYNC, "sync", read<bushd_decode_sync>},
    {BUSHD_MSG_TICKS, "ticks", read<bushd_decode_ticks>},
    {BUSHD_MSG_TABLE_TICKS, "table_ticks", read<bushd_decode_table_ticks>},
    {BUSHD_MSG_TABLE_RUN, "table_run", read<bushd_decode_table_run>},
    {BUSHD_MSG_LINE_RUN, "line_run", read<bushd_decode_line_run>},
    {BUSHD_MSG_LINE_TRIGGER, "line_trigger", read<bushd_decode_line_trigger>},
    {BUSHD_MSG_TRIGGER, "trigger", read<bushd_decode_trigger>},
    {BUSHD_MSG_POSITION_COMPARE, "position_compare", read<bushd_decode_position_compare>},
    {BUSHD_MSG_EMERGENCY, "emergency", read<bushd_decode_emergency>},
    {BUSHD_MSG_EMISSION, "emission", read<bushd_decode_emission>},
    {BUSHD_MSG_SET_ADDRESS, "set_address", read<bushd_decode_set_address>},
    {BUSHD_MSG_TABLES, "get_tables", read_nothing},
    {BUSHD_MSG_INPUTS, "set_inputs", read<bushd_decode_set_inputs>},
    {BUSHD_MSG_MOTOR_INPUTS, "motor_inputs", read<bushd_decode_motor_inputs>},
    {BUSHD_MSG_HOME, "home", read<bushd_decode_home>},
    {BUSHD_MSG_TRAVEL, "travel", read<bushd_decode_travel>},
    {BUSHD_MSG_LOCAL, "local", read<bushd_decode_local>},
    {BUSHD_MSG_CURRENTS, "currents", read<bushd_decode_currents>},
    {BUSHD_MSG_VELOCITY, "set_velocity", read<bushd_decode_set_velocity>},
    {BUSHD_MSG_OUTPUTS, "set_outputs", read<bushd_decode_set_outputs>},
    {BUSHD_MSG_PROGRAM_PUT, "program_put", read<bushd_decode_program_put>},
    {BUSHD_MSG_PROGRAM, "program_control", read<bushd_decode_program_control>},
    {BUSHD_MSG_PROGRAM_STATE, "get_program_state", read_nothing},
    {BUSHD_TYPE_REPLY | BUSHD_MSG_PROGRAM_STATE, "program_state", read<bushd_decode_program_state>},
    {BUSHD_TYPE_REPLY | BUSHD_MSG_TABLES, "tables", read<bushd_decode_tables>},
    {BUSHD_TYPE_REPLY | BUSHD_MSG_IDENTIFY, "identity", read<bushd_decode_identity>},
    {BUSHD_TYPE_REPLY | BUSHD_MSG_POLL, "report", read<bushd_decode_report>},
};

const Row* row_of(const bushd_frame& frame) {
  for (const Row& row : kRows) {
    if (row.type == frame.type) return &row;
  }
  return (frame.type & BUSHD_TYPE_REPLY) != 0 ? &kAcknowledgement : nullptr;
}

}  // namespace

std::string message_text(const bushd_frame& frame) {
  const Row* row = row_of(frame);
  if (row == nullptr) return "unknown message";
  Fields fields;
  const bushd_status status = row->read(frame, &fields);
  if (status != BUSHD_OK) return std::string(row->name) + ": " + bushd_status_text(status);
  return row->name + fields.text();
}

bool is_message(const bushd_frame& frame) {
  const Row* row = row_of(frame);
  return row != nullptr && row->read(frame, nullptr) == BUSHD_OK;
}

std::set<std::string> message_names() {
  std::set<std::string> names{kAcknowledgement.name};
  for (const Row& row : kRows) names.insert(row.name);
  return names;
}

}  // namespace bushd::test
