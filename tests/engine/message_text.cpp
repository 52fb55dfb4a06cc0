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
std::string text(const char* name, const bushd_frame& frame,
                 bushd_status (*decode)(const uint8_t*, size_t, Message*)) {
  Message message{};
  // One report alone does not say which motors there are.
  if constexpr (std::is_same_v<Message, bushd_report>) message.motor_count = BUSHD_MOTORS_PER_MCU;
  const bushd_status status = decode(frame.payload, frame.payload_size, &message);
  if (status != BUSHD_OK) return std::string(name) + ": " + bushd_status_text(status);
  Fields fields;
  put(message, fields);
  return name + fields.text();
}

std::string empty_text(const char* name, const bushd_frame& frame) {
  return frame.payload_size == 0 ? name : std::string(name) + ": payload not empty";
}

}  // namespace

std::string message_text(const bushd_frame& frame) {
  switch (frame.type) {
    case BUSHD_MSG_IDENTIFY:
      return text("identify", frame, bushd_decode_identify);
    case BUSHD_MSG_CONFIGURE:
      return text("configure", frame, bushd_decode_configure);
    case BUSHD_MSG_TABLE_BEGIN:
      return text("table_begin", frame, bushd_decode_table_begin);
    case BUSHD_MSG_TABLE_DATA:
      return text("table_data", frame, bushd_decode_table_data);
    case BUSHD_MSG_TABLE_END:
      return text("table_end", frame, bushd_decode_table_end);
    case BUSHD_MSG_ASSIGN:
      return text("assign", frame, bushd_decode_assign);
    case BUSHD_MSG_CONTROL:
      return text("control", frame, bushd_decode_control);
    case BUSHD_MSG_SET_POSITION:
      return text("set_position", frame, bushd_decode_set_position);
    case BUSHD_MSG_POLL:
      return text("poll", frame, bushd_decode_poll);
    case BUSHD_MSG_SYNC:
      return text("sync", frame, bushd_decode_sync);
    case BUSHD_MSG_TICKS:
      return text("ticks", frame, bushd_decode_ticks);
    case BUSHD_MSG_TABLE_TICKS:
      return text("table_ticks", frame, bushd_decode_table_ticks);
    case BUSHD_MSG_TABLE_RUN:
      return text("table_run", frame, bushd_decode_table_run);
    case BUSHD_MSG_LINE_RUN:
      return text("line_run", frame, bushd_decode_line_run);
    case BUSHD_MSG_LINE_TRIGGER:
      return text("line_trigger", frame, bushd_decode_line_trigger);
    case BUSHD_MSG_TRIGGER:
      return text("trigger", frame, bushd_decode_trigger);
    case BUSHD_MSG_POSITION_COMPARE:
      return text("position_compare", frame, bushd_decode_position_compare);
    case BUSHD_MSG_EMERGENCY:
      return text("emergency", frame, bushd_decode_emergency);
    case BUSHD_MSG_EMISSION:
      return text("emission", frame, bushd_decode_emission);
    case BUSHD_MSG_SET_ADDRESS:
      return text("set_address", frame, bushd_decode_set_address);
    case BUSHD_MSG_TABLES:
      return empty_text("get_tables", frame);
    case BUSHD_MSG_INPUTS:
      return text("set_inputs", frame, bushd_decode_set_inputs);
    case BUSHD_MSG_MOTOR_INPUTS:
      return text("motor_inputs", frame, bushd_decode_motor_inputs);
    case BUSHD_MSG_HOME:
      return text("home", frame, bushd_decode_home);
    case BUSHD_MSG_TRAVEL:
      return text("travel", frame, bushd_decode_travel);
    case BUSHD_MSG_LOCAL:
      return text("local", frame, bushd_decode_local);
    case BUSHD_MSG_CURRENTS:
      return text("currents", frame, bushd_decode_currents);
    case BUSHD_MSG_VELOCITY:
      return text("set_velocity", frame, bushd_decode_set_velocity);
    case BUSHD_MSG_OUTPUTS:
      return text("set_outputs", frame, bushd_decode_set_outputs);
    case BUSHD_MSG_PROGRAM_PUT:
      return text("program_put", frame, bushd_decode_program_put);
    case BUSHD_MSG_PROGRAM:
      return text("program_control", frame, bushd_decode_program_control);
    case BUSHD_MSG_PROGRAM_STATE:
      return empty_text("get_program_state", frame);
    case BUSHD_TYPE_REPLY | BUSHD_MSG_PROGRAM_STATE:
      return text("program_state", frame, bushd_decode_program_state);
    case BUSHD_TYPE_REPLY | BUSHD_MSG_TABLES:
      return text("tables", frame, bushd_decode_tables);
    case BUSHD_TYPE_REPLY | BUSHD_MSG_IDENTIFY:
      return text("identity", frame, bushd_decode_identity);
    case BUSHD_TYPE_REPLY | BUSHD_MSG_POLL:
      return text("report", frame, bushd_decode_report);
    default:
      if (frame.type & BUSHD_TYPE_REPLY) {
        return text("acknowledgement", frame, bushd_decode_acknowledgement);
      }
      return "unknown message";
  }
}

std::set<std::string> message_names() {
  return {"identify",
          "identity",
          "configure",
          "table_begin",
          "table_data",
          "table_end",
          "assign",
          "control",
          "set_position",
          "poll",
          "report",
          "sync",
          "ticks",
          "acknowledgement",
          "table_ticks",
          "table_run",
          "emergency",
          "set_address",
          "get_tables",
          "tables",
          "set_inputs",
          "emission",
          "home",
          "local",
          "trigger",
          "position_compare",
          "motor_inputs",
          "line_run",
          "travel",
          "currents",
          "line_trigger",
          "set_velocity",
          "set_outputs",
          "program_put",
          "program_control",
          "get_program_state",
          "program_state"};
}

}  // namespace bushd::test
