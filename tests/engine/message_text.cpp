#include "engine/message_text.h"

#include <cstdint>

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

void put(const bushd_identity& m, Fields& f) {
  f.add("protocol_version", m.protocol_version).add("motors", m.motors);
  f.add("firmware_version", m.firmware_version).add("boot_number", m.boot_number);
  f.add("slots", m.slots).add("queue_ticks", m.queue_ticks).add("table_codes", m.table_codes);
}
void put(const bushd_configure& m, Fields& f) {
  f.add("tick_ns", m.tick_ns).add("format", m.format);
}
void put(const bushd_table_begin& m, Fields& f) {
  f.add("slot", m.slot).add("accel_count", m.accel_count).add("decel_count", m.decel_count);
  f.add("cruise", m.cruise).add("time_unit_ns", m.time_unit_ns);
}
void put(const bushd_table_data& m, Fields& f) {
  f.add("slot", m.slot).add("offset", m.offset).add("count", m.count);
  f.add_list("codes", m.codes, m.count, 2);
}
void put(const bushd_table_end& m, Fields& f) {
  f.add("slot", m.slot).add("crc", m.crc);
}
void put(const bushd_assign& m, Fields& f) {
  f.add("motor", m.motor).add("slot", m.slot);
}
void put(const bushd_control& m, Fields& f) {
  f.add("actions", m.actions);
}
void put(const bushd_set_position& m, Fields& f) {
  f.add("motor", m.motor).add("position_steps", m.position_steps);
}
void put(const bushd_sync& m, Fields& f) {
  f.add("follows", m.follows).add("mark_tag", m.mark_tag);
  f.add("mark_tick", m.mark_tick).add("mark_ns", m.mark_ns);
}
void put(const bushd_ticks& m, Fields& f) {
  f.add("epoch", m.epoch).add("flags", m.flags).add("first_tick", m.first_tick);
  f.add("count", m.count).add("mask", m.mask);
  f.add_list("delays", m.delays, m.delays == nullptr ? 0 : m.motors, 2);
  const size_t width = m.flags & BUSHD_TICKS_FINE ? 2 : 1;
  f.add_list("displacements", m.displacements, width * m.motors * m.count, 1);
}
void put(const bushd_report& m, Fields& f) {
  f.add("state", m.state).add("faults", m.faults).add("flags", m.flags).add("epoch", m.epoch);
  f.add("boot_number", m.boot_number).add("tick", m.tick).add("tick_ns", m.tick_ns);
  f.add("mark_tag", m.mark_tag).add("mark_tick", m.mark_tick).add("mark_ns", m.mark_ns);
  f.add("moving", m.moving).add("inputs", m.inputs).add("bad_frames", m.bad_frames);
  f.add("rejected_frames", m.rejected_frames).add("last_rejection", m.last_rejection);
  f.add("motor_count", m.motor_count);
  std::string motors;
  for (size_t i = 0; i < m.motor_count; ++i) {
    motors += (i > 0 ? ":" : "") + std::to_string(m.motor[i].position_steps) + "/" +
              std::to_string(m.motor[i].known_until);
  }
  f.add_text("motor", motors);
}
void put(const bushd_acknowledgement& m, Fields& f) {
  f.add("status", m.status);
}

template <class Message>
std::string text(const char* name, const bushd_frame& frame,
                 bushd_status (*decode)(const uint8_t*, size_t, Message*)) {
  Message message{};
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
      return empty_text("identify", frame);
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
      return empty_text("poll", frame);
    case BUSHD_MSG_SYNC:
      return text("sync", frame, bushd_decode_sync);
    case BUSHD_MSG_TICKS:
      return text("ticks", frame, bushd_decode_ticks);
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
  return {"identify",  "identity", "configure", "table_begin",    "table_data",
          "table_end", "assign",   "control",   "set_position",   "poll",
          "report",    "sync",     "ticks",     "acknowledgement"};
}

}  // namespace bushd::test
