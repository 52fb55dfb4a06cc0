// The golden vectors of tests/vectors against the engine as the host uses it.
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "engine/frame.h"
#include "engine/line.h"
#include "engine/line_follower.h"
#include "engine/message.h"
#include "engine/message_text.h"
#include "engine/run.h"
#include "engine/run_state.h"
#include "engine/slots.h"
#include "engine/tables.h"
#include "source_path.h"

namespace bushd::test::vectors_test {
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
  const std::string path = source_path("tests/vectors/" + name);
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
    const std::string decel = row.at("decel");
    return {numbers<uint16_t>(row.at("accel")),
            numbers<uint16_t>(decel.empty() ? row.at("accel") : decel),
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
                      steps < 0 ? -1 : 1, number<uint16_t>(row, "shortest_delay"));
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

TEST(Vectors, RunStates) {
  for (const Row& row : read_csv("run_states.csv")) {
    for (const bool indexed : {false, true}) {
      SCOPED_TRACE(row.at("table") + ' ' + row.at("steps") + " tick " + row.at("tick"));
      const TestTable table(law_of(row.at("table")), indexed);
      const auto steps = number<int64_t>(row, "steps");
      const auto tick_ns = number<uint32_t>(row, "tick_ns");
      const auto tick = number<size_t>(row, "tick");
      bushd_run run;
      bushd_run_start(&run, table.view(), static_cast<uint32_t>(std::abs(steps)),
                      steps < 0 ? -1 : 1, number<uint16_t>(row, "shortest_delay"));
      std::vector<uint8_t> before;
      const std::string stop = row.at("ramp_down_at_tick");
      const size_t stopped = stop.empty() ? tick : std::stoul(stop);
      expand(&run, row, stopped, &before);
      if (!stop.empty()) bushd_run_ramp_down(&run);
      expand(&run, row, tick - stopped, &before);
      const bushd_run_state s = bushd_run_save(&run, tick_ns, number<uint16_t>(row, "ticks"));
      const std::vector<int64_t> parts{s.accel_at, s.accel_end, s.cruise_left, s.decel_left};
      std::vector<int64_t> state{s.direction, s.cruises, s.since, s.since_ns, s.lead_delay};
      for (const int64_t part : parts) state.push_back(s.cruises ? 0 : part);
      state.push_back(s.cruise);
      EXPECT_EQ(state, numbers<int64_t>(row.at("state"), '/'));
      bushd_run taken_up;
      ASSERT_TRUE(bushd_run_restore(&taken_up, table.view(), &s));
      const auto expected = bytes_of(row.at("displacements"));
      std::vector<uint8_t> got;
      expand(&taken_up, row, expected.size() / (row.at("format") == "fine" ? 2 : 1), &got);
      EXPECT_EQ(got, expected);
    }
  }
}

TEST(Vectors, Lines) {
  for (const Row& row : read_csv("lines.csv")) {
    SCOPED_TRACE(row.at("increment") + " of " + row.at("longest"));
    const auto first = number<uint32_t>(row, "first");
    const auto made = numbers<uint32_t>(row.at("made"));
    const auto fractions = numbers<uint8_t>(row.at("fractions"));
    const auto positions = numbers<uint64_t>(row.at("positions"));
    ASSERT_EQ(made.size(), number<uint32_t>(row, "last") - first + 1);
    bushd_line line;
    bushd_line_start(&line, number<uint32_t>(row, "increment"), number<uint32_t>(row, "longest"));
    bushd_line_go_to(&line, first);
    for (size_t i = 0; i < made.size(); ++i) {
      EXPECT_EQ(line.made, made[i]) << first + i;
      if (i == positions.size()) break;
      EXPECT_EQ(bushd_line_position(&line, fractions[i]), positions[i]) << first + i;
      EXPECT_EQ(bushd_line_follow(&line, 1), made[i + 1] - made[i]) << first + i + 1;
    }
  }
}

TEST(Vectors, LineFollowers) {
  for (const Row& row : read_csv("lines.csv")) {
    SCOPED_TRACE(row.at("increment") + " of " + row.at("longest"));
    const auto first = number<uint32_t>(row, "first");
    const auto longest = number<uint32_t>(row, "longest");
    if (number<uint32_t>(row, "increment") == 0) continue;
    const auto made = numbers<uint32_t>(row.at("made"));
    const auto fractions = numbers<uint8_t>(row.at("fractions"));
    const auto positions = numbers<uint64_t>(row.at("positions"));
    bushd_line_follower follower;
    bushd_line_follower_start(&follower, number<uint32_t>(row, "increment"), longest, first);
    uint64_t so_far = made[0];
    const auto go_to = [&](uint32_t step, uint16_t parts) {
      if (!bushd_line_follower_due(&follower, step, parts)) return;
      bushd_line_follower_step(&follower);
      ++so_far;
    };
    for (size_t i = 0; i < positions.size(); ++i) {
      const auto step = static_cast<uint32_t>(first + i + 1);
      EXPECT_EQ(so_far, made[i]) << step;
      go_to(step, fractions[i]);
      const auto fraction = bushd_line_follower_fraction(&follower, longest, step, fractions[i]);
      EXPECT_EQ(so_far * 256 + fraction, positions[i]) << step;
      go_to(step, 256);
    }
    EXPECT_EQ(so_far, made.back());
  }
}

TEST(Vectors, TableChecksums) {
  for (const Row& row : read_csv("tables.csv")) {
    const TestTable table(law_of(row.at("table")), true);
    bushd_table view = *table.view();
    if (row.at("decel").empty()) view.decel = view.accel;
    EXPECT_EQ(bushd_table_crc32(&view), number<uint32_t>(row, "crc32")) << row.at("table");
  }
}

TEST(Vectors, IdentifyWindows) {
  for (const Row& row : read_csv("identify_windows.csv")) {
    EXPECT_EQ(bushd_identify_window(bytes_of(row.at("unique_id")).data(),
                                    number<uint16_t>(row, "salt"), number<uint8_t>(row, "windows")),
              number<int>(row, "window"))
        << row.at("unique_id") << " salt " << row.at("salt");
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
    EXPECT_EQ(frame.sequence, number<int>(row, "sequence"));
    EXPECT_EQ(message_text(frame),
              row.at("message") + (row.at("fields").empty() ? "" : " ") + row.at("fields"));
    std::vector<uint8_t> again(BUSHD_FRAME_MAX_WIRE);
    again.resize(bushd_frame_encode(frame.address, frame.type, frame.sequence, frame.payload,
                                    frame.payload_size, again.data()));
    EXPECT_EQ(again, wire);
  }
}

TEST(Vectors, HaveAFrameOfEveryMessage) {
  std::set<std::string> seen;
  for (const Row& row : read_csv("frames.csv")) seen.insert(row.at("message"));
  EXPECT_EQ(seen, message_names());
}

}  // namespace
}  // namespace bushd::test::vectors_test
