// The golden vectors of tests/vectors against the engine as the host uses it.
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "engine/frame.h"
#include "engine/message.h"
#include "engine/run.h"
#include "engine/slots.h"
#include "engine/tables.h"

namespace bushd::test {
namespace {

using Row = std::map<std::string, std::string>;

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts{""};
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::vector<Row> read_csv(const std::string& name) {
  const std::string path = std::string(BUSHD_SOURCE_DIR) + "/tests/vectors/" + name;
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  std::string line;
  std::getline(file, line);
  const auto keys = split(line, ',');
  std::vector<Row> rows;
  while (std::getline(file, line)) {
    const auto values = split(line, ',');
    EXPECT_EQ(values.size(), keys.size()) << path << ": " << line;
    Row row;
    for (size_t i = 0; i < keys.size(); ++i) row[keys[i]] = values.at(i);
    rows.push_back(row);
  }
  EXPECT_FALSE(rows.empty()) << path;
  return rows;
}

template <class T>
std::vector<T> numbers(const std::string& text, char separator = ' ') {
  std::vector<T> out;
  if (text.empty()) return out;
  for (const auto& part : split(text, separator)) out.push_back(static_cast<T>(std::stoll(part)));
  return out;
}

std::vector<uint8_t> bytes_of(const std::string& hex) {
  std::vector<uint8_t> out;
  for (size_t i = 0; i + 1 < hex.size(); i += 2) {
    out.push_back(static_cast<uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return out;
}

template <class T>
T number(const Row& row, const std::string& key) {
  return static_cast<T>(std::stoll(row.at(key)));
}

Law law_of(const std::string& name) {
  for (const Row& row : read_csv("tables.csv")) {
    if (row.at("table") != name) continue;
    return {numbers<uint16_t>(row.at("accel")), numbers<uint16_t>(row.at("decel")),
            number<uint16_t>(row, "cruise"), number<uint32_t>(row, "time_unit_ns")};
  }
  ADD_FAILURE() << "no table " << name;
  return {};
}

// Appends the next ticks as bytes of the bus; all of them must be active.
void expand(bushd_run* run, const Row& row, size_t ticks, std::vector<uint8_t>* bytes) {
  const auto tick_ns = number<uint32_t>(row, "tick_ns");
  if (row.at("format") == "coarse") {
    std::vector<uint8_t> out(ticks);
    EXPECT_EQ(bushd_run_expand_coarse(run, tick_ns, ticks, out.data(), 1), ticks);
    bytes->insert(bytes->end(), out.begin(), out.end());
    return;
  }
  std::vector<int16_t> out(ticks);
  EXPECT_EQ(bushd_run_expand_fine(run, tick_ns, ticks, out.data(), 1), ticks);
  for (const int16_t displacement : out) {
    uint8_t wire[2];
    bushd_put_i16(wire, displacement);
    bytes->insert(bytes->end(), wire, wire + 2);
  }
}

TEST(Vectors, Moves) {
  for (const Row& row : read_csv("moves.csv")) {
    for (const bool indexed : {false, true}) {
      const TestTable table(law_of(row.at("table")), indexed);
      const auto steps = number<int64_t>(row, "steps");
      const auto expected = bytes_of(row.at("displacements"));
      const size_t ticks = expected.size() / (row.at("format") == "fine" ? 2 : 1);
      bushd_run run;
      bushd_run_start(&run, table.view(), static_cast<uint32_t>(std::abs(steps)),
                      steps < 0 ? -1 : 1);
      std::vector<uint8_t> got;
      const std::string stop = row.at("ramp_down_at_tick");
      const size_t before = stop.empty() ? 0 : std::stoul(stop);
      expand(&run, row, before, &got);
      if (!stop.empty()) bushd_run_ramp_down(&run);
      expand(&run, row, ticks - before, &got);
      EXPECT_EQ(got, expected) << row.at("table") << ' ' << steps << (indexed ? " indexed" : "");
      EXPECT_TRUE(bushd_run_done(&run));
    }
  }
}

TEST(Vectors, TakeOvers) {
  for (const Row& row : read_csv("take_overs.csv")) {
    for (const bool indexed : {false, true}) {
      const TestTable table(law_of(row.at("table")), indexed);
      const auto expected = bytes_of(row.at("displacements"));
      bushd_run run;
      bushd_run_start_ramp_down(&run, table.view(), number<uint16_t>(row, "delay"),
                                number<uint8_t>(row, "fraction"), number<int>(row, "direction"));
      std::vector<uint8_t> got;
      expand(&run, row, expected.size() / (row.at("format") == "fine" ? 2 : 1), &got);
      EXPECT_EQ(got, expected) << row.at("table") << ' ' << row.at("delay");
      EXPECT_TRUE(bushd_run_done(&run));
    }
  }
}

TEST(Vectors, Slots) {
  for (const Row& row : read_csv("slots.csv")) {
    const auto slot_count = number<uint16_t>(row, "slot_count");
    const auto expected = split(row.at("slots"), ';');
    const auto displacements = numbers<int16_t>(row.at("displacements"));
    ASSERT_EQ(expected.size(), displacements.size());
    int16_t remainder = 0;
    for (size_t n = 0; n < displacements.size(); ++n) {
      std::vector<uint16_t> masks(slot_count);
      bushd_slots_add(masks.data(), slot_count, 1, displacements[n], &remainder,
                      number<int16_t>(row, "crossing"));
      std::vector<uint16_t> slots;
      for (uint16_t slot = 0; slot < slot_count; ++slot) {
        if (masks[slot] != 0) slots.push_back(slot);
      }
      EXPECT_EQ(slots, numbers<uint16_t>(expected[n])) << row.at("displacements") << " tick " << n;
    }
    EXPECT_EQ(remainder, number<int16_t>(row, "remainder"));
  }
}

// Fields of a decoded message in the notation of frames.csv.
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
    text_ += std::string(text_.empty() ? "" : " ") + name + "=" + value;
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

using Describe = std::function<bushd_status(const bushd_frame&, Fields&)>;

template <class Message>
Describe describe(bushd_status (*decode)(const uint8_t*, size_t, Message*),
                  std::function<void(const Message&, Fields&)> put) {
  return [=](const bushd_frame& frame, Fields& fields) {
    Message message{};
    const bushd_status status = decode(frame.payload, frame.payload_size, &message);
    if (status == BUSHD_OK) put(message, fields);
    return status;
  };
}

bushd_status describe_nothing(const bushd_frame& frame, Fields&) {
  return frame.payload_size == 0 ? BUSHD_OK : BUSHD_E_LENGTH;
}

void put_identity(const bushd_identity& m, Fields& f) {
  f.add("protocol_version", m.protocol_version).add("motors", m.motors);
  f.add("firmware_version", m.firmware_version).add("boot_number", m.boot_number);
  f.add("slots", m.slots).add("queue_ticks", m.queue_ticks).add("table_codes", m.table_codes);
}
void put_configure(const bushd_configure& m, Fields& f) {
  f.add("tick_ns", m.tick_ns).add("format", m.format);
}
void put_table_begin(const bushd_table_begin& m, Fields& f) {
  f.add("slot", m.slot).add("accel_count", m.accel_count).add("decel_count", m.decel_count);
  f.add("cruise", m.cruise).add("time_unit_ns", m.time_unit_ns);
}
void put_table_data(const bushd_table_data& m, Fields& f) {
  f.add("slot", m.slot).add("offset", m.offset).add("count", m.count);
  f.add_list("codes", m.codes, m.count, 2);
}
void put_ticks(const bushd_ticks& m, Fields& f) {
  f.add("epoch", m.epoch).add("flags", m.flags).add("first_tick", m.first_tick);
  f.add("count", m.count).add("mask", m.mask);
  f.add_list("delays", m.delays, m.delays == nullptr ? 0 : m.motors, 2);
  const size_t width = m.flags & BUSHD_TICKS_FINE ? 2 : 1;
  f.add_list("displacements", m.displacements, width * m.motors * m.count, 1);
}
void put_report(const bushd_report& m, Fields& f) {
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

const std::map<std::string, Describe>& descriptions() {
  static const std::map<std::string, Describe> all{
      {"identify", describe_nothing},
      {"poll", describe_nothing},
      {"identity", describe<bushd_identity>(bushd_decode_identity, put_identity)},
      {"configure", describe<bushd_configure>(bushd_decode_configure, put_configure)},
      {"table_begin", describe<bushd_table_begin>(bushd_decode_table_begin, put_table_begin)},
      {"table_data", describe<bushd_table_data>(bushd_decode_table_data, put_table_data)},
      {"table_end", describe<bushd_table_end>(
                        bushd_decode_table_end,
                        [](const auto& m, Fields& f) { f.add("slot", m.slot).add("crc", m.crc); })},
      {"assign", describe<bushd_assign>(bushd_decode_assign,
                                        [](const auto& m, Fields& f) {
                                          f.add("motor", m.motor).add("slot", m.slot);
                                        })},
      {"control",
       describe<bushd_control>(bushd_decode_control,
                               [](const auto& m, Fields& f) { f.add("actions", m.actions); })},
      {"set_position", describe<bushd_set_position>(
                           bushd_decode_set_position,
                           [](const auto& m, Fields& f) {
                             f.add("motor", m.motor).add("position_steps", m.position_steps);
                           })},
      {"sync", describe<bushd_sync>(bushd_decode_sync,
                                    [](const auto& m, Fields& f) {
                                      f.add("follows", m.follows).add("mark_tag", m.mark_tag);
                                      f.add("mark_tick", m.mark_tick).add("mark_ns", m.mark_ns);
                                    })},
      {"ticks", describe<bushd_ticks>(bushd_decode_ticks, put_ticks)},
      {"report", describe<bushd_report>(bushd_decode_report, put_report)},
      {"acknowledgement", describe<bushd_acknowledgement>(
                              bushd_decode_acknowledgement,
                              [](const auto& m, Fields& f) { f.add("status", m.status); })},
  };
  return all;
}

TEST(Vectors, Frames) {
  for (const Row& row : read_csv("frames.csv")) {
    SCOPED_TRACE(row.at("message"));
    const auto wire = bytes_of(row.at("wire"));
    bushd_receiver receiver{};
    bushd_frame frame{};
    for (size_t i = 0; i < wire.size(); ++i) {
      ASSERT_EQ(bushd_receive_byte(&receiver, wire[i], &frame),
                i + 1 < wire.size() ? BUSHD_RECEIVE_MORE : BUSHD_RECEIVE_FRAME);
    }
    EXPECT_EQ(frame.address, number<int>(row, "address"));
    EXPECT_EQ(frame.type, number<int>(row, "type"));
    EXPECT_EQ(frame.tag, number<int>(row, "tag"));
    Fields fields;
    ASSERT_EQ(descriptions().at(row.at("message"))(frame, fields), BUSHD_OK);
    EXPECT_EQ(fields.text(), row.at("fields"));
    std::vector<uint8_t> again(BUSHD_FRAME_MAX_WIRE);
    again.resize(bushd_frame_encode(frame.address, frame.type, frame.tag, frame.payload,
                                    frame.payload_size, again.data()));
    EXPECT_EQ(again, wire);
  }
}

TEST(Vectors, HaveAFrameOfEveryMessage) {
  std::map<std::string, int> seen;
  for (const Row& row : read_csv("frames.csv")) ++seen[row.at("message")];
  for (const auto& [message, describe_it] : descriptions()) EXPECT_GE(seen[message], 1) << message;
}

}  // namespace
}  // namespace bushd::test
