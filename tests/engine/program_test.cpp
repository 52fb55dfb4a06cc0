// Programs as bytes: what is one, and that the document has the same frames.
#include "engine/program.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "engine/message.h"
#include "source_path.h"

namespace bushd::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kTwo = 3;  // motors 0 and 1

// A head for motors 0 and 1, and these frames.
Bytes program(const Bytes& frames) {
  Bytes bytes = {1, 0, kTwo, 0};
  for (int motor = 0; motor < 2; ++motor) {
    const Bytes part = {5, 0xF6, 0xFF, 0xFF, 0xFF, 20, 0, 0, 0};
    bytes.insert(bytes.end(), part.begin(), part.end());
  }
  bytes.insert(bytes.end(), frames.begin(), frames.end());
  return bytes;
}

bushd_status check(const Bytes& bytes, std::uint16_t own = 0xF) {
  bushd_program read;
  return bushd_program_check(bytes.data(), bytes.size(), own, &read);
}

TEST(Program, IsReadAsItWasWritten) {
  const Bytes bytes = program({
      3,  3,    0,    7,    0x34, 0x12, 2, 0, 1, 0,    0,    0,    2,    0, 0,
      0,  0xFF, 0xFF, 0xFF, 0xFF, 4,    0, 0, 0,                                //
      2,  2,    0,    9,    0,    0,    0, 8, 7,                                //
      5,  0x10, 0x27, 0,    0,                                                  //
      6,  19,   1,    1,    0,    0,    0,                                      //
      8,  3,    0,                                                              //
      7,  50,   0,    0,    0,                                                  //
      9,                                                                        //
      11, 1,    0,    16,   0,    7,    0, 0, 0, 0xF6, 0xFF, 0xFF, 0xFF, 8, 7,  //
      0,
  });
  bushd_program read;
  ASSERT_EQ(bushd_program_check(bytes.data(), bytes.size(), 0xF, &read), BUSHD_OK);
  EXPECT_EQ(read.motors, kTwo);
  EXPECT_EQ(bushd_program_part(&read, 1).bank, 5);
  EXPECT_EQ(bushd_program_part(&read, 1).least_steps, -10);
  EXPECT_EQ(bushd_program_part(&read, 1).most_steps, 20);
  const std::uint8_t* at = read.frames;
  bushd_program_frame frame = bushd_next_program_frame(&read, &at);
  EXPECT_EQ(frame.kind, BUSHD_PROGRAM_LINE_TO);
  EXPECT_EQ(frame.motors, kTwo);
  EXPECT_EQ(frame.bank, 7);
  EXPECT_EQ(frame.shortest_delay, 0x1234);
  EXPECT_EQ(frame.points, 2);
  EXPECT_EQ(bushd_program_entry_of(&frame, 0, 1).steps, 2);
  EXPECT_EQ(bushd_program_entry_of(&frame, 1, 0).steps, -1);
  EXPECT_EQ(bushd_program_entry_of(&frame, 1, 1).steps, 4);
  frame = bushd_next_program_frame(&read, &at);
  EXPECT_EQ(frame.kind, BUSHD_PROGRAM_MOVE_BY);
  EXPECT_EQ(bushd_program_entry_of(&frame, 0, 0).steps, 9);
  EXPECT_EQ(bushd_program_entry_of(&frame, 0, 0).shortest_delay, 0x0708);
  EXPECT_EQ(bushd_next_program_frame(&read, &at).us, 10'000u);
  frame = bushd_next_program_frame(&read, &at);
  EXPECT_EQ(frame.input, 19);
  EXPECT_TRUE(frame.level);
  EXPECT_EQ(bushd_next_program_frame(&read, &at).count, 3);
  EXPECT_EQ(bushd_next_program_frame(&read, &at).us, 50u);
  EXPECT_EQ(bushd_next_program_frame(&read, &at).kind, BUSHD_PROGRAM_NEXT);
  frame = bushd_next_program_frame(&read, &at);
  EXPECT_EQ(frame.kind, BUSHD_PROGRAM_MOVE_UNTIL);
  EXPECT_EQ(frame.input, 16);
  EXPECT_FALSE(frame.level);
  EXPECT_EQ(frame.after_steps, 7u);
  EXPECT_EQ(bushd_program_entry_of(&frame, 0, 0).steps, -10);
  EXPECT_EQ(bushd_program_entry_of(&frame, 0, 0).shortest_delay, 0x0708);
  EXPECT_EQ(bushd_next_program_frame(&read, &at).kind, BUSHD_PROGRAM_END);
  EXPECT_EQ(at, read.end);
}

TEST(Program, EveryCutIsFound) {
  const Bytes bytes = program({8, 3, 0, 1, 1, 0, 9, 0, 0, 0, 8, 7, 9, 5, 1, 0, 0, 0, 0});
  ASSERT_EQ(check(bytes), BUSHD_OK);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(check(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size))),
              BUSHD_E_LENGTH)
        << size;
  }
  Bytes longer = bytes;
  longer.push_back(0);
  EXPECT_EQ(check(longer), BUSHD_E_LENGTH) << "bytes behind END";
}

TEST(Program, WhatIsOutOfRangeIsRefused) {
  const auto head = [](std::size_t at, std::uint8_t value) {
    Bytes bytes = program({0});
    bytes[at] = value;
    return bytes;
  };
  ASSERT_EQ(check(program({0})), BUSHD_OK);
  EXPECT_EQ(check(head(0, 2)), BUSHD_E_VERSION);
  for (const int flags : {4, 5, 6, 8, 16, 0x80}) {
    EXPECT_EQ(check(head(1, static_cast<std::uint8_t>(flags))), BUSHD_E_FORMAT) << flags;
  }
  EXPECT_EQ(check(head(4, 8)), BUSHD_E_FORMAT) << "the volatile bank";
  EXPECT_EQ(check(head(12, 0x80)), BUSHD_E_FORMAT) << "no place to be in";
  EXPECT_EQ(check(program({0}), 1), BUSHD_E_FORMAT) << "the MCU has one motor";
  EXPECT_EQ(check({1, 0, 0, 0, 0}), BUSHD_E_FORMAT) << "no motor";
  const std::map<std::string, Bytes> frames = {
      {"no such frame", {12}},
      {"two motors until an input",
       {11, 3, 0, 0, 1, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0}},
      {"a motor that is not the program's, until an input",
       {11, 4, 0, 0, 1, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0}},
      {"until input 20", {11, 1, 0, 20, 1, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0}},
      {"until level 2", {11, 1, 0, 0, 2, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0}},
      {"too many steps after it", {11, 1, 0, 0, 1, 0, 0, 0, 0x80, 9, 0, 0, 0, 0, 0}},
      {"a travel of two motors", {10, 3, 0, 0, 0, 0, 0, 0, 0, 50, 0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0}},
      {"a travel of a motor that is not the program's",
       {10, 4, 0, 0, 0, 0, 0, 0, 0, 50, 0, 0, 0, 9, 0, 0, 0}},
      {"a travel of no step", {10, 1, 0, 0, 0, 0, 0, 0, 0, 50, 0, 0, 0, 0, 0, 0, 0}},
      {"a travel by a bank that there is not",
       {10, 1, 0, 9, 0, 0, 0, 0, 0, 50, 0, 0, 0, 9, 0, 0, 0}},
      {"a travel at a third edge", {10, 1, 0, 0, 3, 50, 0, 0, 0, 50, 0, 0, 0, 9, 0, 0, 0}},
      {"a travel that returns too soon", {10, 1, 0, 0, 0, 0, 0, 0, 0, 49, 0, 0, 0, 9, 0, 0, 0}},
      {"a delay from no edge", {10, 1, 0, 0, 0, 50, 0, 0, 0, 50, 0, 0, 0, 9, 0, 0, 0}},
      {"no motor", {1, 0, 0}},
      {"a motor that is not the program's", {1, 4, 0, 9, 0, 0, 0, 0, 0}},
      {"no point", {3, 1, 0, 0, 0, 0, 0, 0}},
      {"a line by a bank that there is not", {3, 1, 0, 9, 0, 0, 1, 0, 1, 0, 0, 0}},
      {"an elementary line by such a bank", {3, 1, 0, 0x89, 0, 0, 1, 0, 1, 0, 0, 0}},
      {"no wait", {5, 0, 0, 0, 0}},
      {"too long a wait", {5, 1, 0xA4, 0x93, 0xD6}},
      {"input 20", {6, 20, 1, 0, 0, 0, 0}},
      {"level 2", {6, 1, 2, 0, 0, 0, 0}},
      {"too long a wait for an input", {6, 1, 1, 1, 0xA4, 0x93, 0xD6}},
      {"no pulse", {7, 0, 0, 0, 0}},
      {"too long a pulse", {7, 0x41, 0x42, 0x0F, 0}},
      {"NEXT without REPEAT", {9}},
      {"five REPEATs", {8, 2, 0, 8, 2, 0, 8, 2, 0, 8, 2, 0, 8, 2, 0, 9, 9, 9, 9, 9}},
      {"REPEAT without NEXT", {8, 2, 0}},
  };
  for (const auto& [what, frame] : frames) {
    Bytes with_end = frame;
    with_end.push_back(0);
    EXPECT_EQ(check(program(with_end)), BUSHD_E_FORMAT) << what;
  }
  EXPECT_EQ(check(program({3, 1, 0, 8, 0, 0, 1, 0, 1, 0, 0, 0, 0})), BUSHD_OK)
      << "a line by the volatile bank";
  EXPECT_EQ(check(program({3, 1, 0, 0x88, 0, 0, 1, 0, 1, 0, 0, 0, 0})), BUSHD_OK)
      << "an elementary one";
  EXPECT_EQ(check(program({10, 2, 0, 8, 1, 50, 0, 0, 0, 50, 0, 0, 0, 0xF7, 0xFF, 0xFF, 0xFF, 0})),
            BUSHD_OK)
      << "a travel by the volatile bank";
  EXPECT_EQ(check(program({5, 0, 0xA4, 0x93, 0xD6, 0})), BUSHD_OK) << "an hour";
  EXPECT_EQ(check(program({7, 0x40, 0x42, 0x0F, 0, 0})), BUSHD_OK) << "a second";
  EXPECT_EQ(check(program({8, 2, 0, 8, 2, 0, 8, 2, 0, 8, 2, 0, 9, 9, 9, 9, 0})), BUSHD_OK)
      << "four REPEATs";
}

// Whatever is no program is refused without a byte being read beyond its end (asan sees that), and
// a program is read whole.
TEST(Program, RandomBytesAreRefusedOrRead) {
  std::mt19937 random(5);
  int good = 0;
  for (int i = 0; i < 200'000; ++i) {
    Bytes frames;
    for (std::size_t left = random() % 30; left > 0; --left) {
      frames.push_back(static_cast<std::uint8_t>(random() % (random() % 2 == 0 ? 12 : 256)));
    }
    frames.push_back(0);
    const Bytes bytes = program(frames);
    const std::vector<std::uint8_t> exact(bytes);
    bushd_program read;
    if (bushd_program_check(exact.data(), exact.size(), 0xF, &read) != BUSHD_OK) continue;
    ++good;
    const std::uint8_t* at = read.frames;
    while (bushd_next_program_frame(&read, &at).kind != BUSHD_PROGRAM_END) ASSERT_LT(at, read.end);
    ASSERT_EQ(at, read.end);
  }
  EXPECT_GT(good, 1000);
}

// The rows of docs/protocol.md: code, name, bytes of its own fields, bytes for each motor.
TEST(ProgramDocument, HasTheFramesOfTheEngine) {
  struct Row {
    std::string name;
    int own;
    int motor;
    bool operator==(const Row&) const = default;
  };
  std::map<int, Row> expected;
#define ROW(name, code, own, motor) expected[code] = {#name, own, motor};
  BUSHD_PROGRAM_FRAMES(ROW)
#undef ROW
  std::map<int, Row> found;
  std::ifstream page(source_path("docs/protocol.md"));
  static const std::regex kRow(R"(\| (\d+) \| ([A-Z ]+) \| (\d+) \| (\d+) \|.*)");
  bool in_table = false;
  std::smatch row;
  for (std::string line; std::getline(page, line);) {
    if (line == "| code | frame | bytes | for each motor | fields |") in_table = true;
    if (in_table && line.empty()) break;
    if (!in_table || !std::regex_match(line, row, kRow)) continue;
    std::string name = row[2];
    std::ranges::replace(name, ' ', '_');
    found[std::stoi(row[1])] = {name, std::stoi(row[3]), std::stoi(row[4])};
  }
  EXPECT_EQ(found, expected);
}

}  // namespace
}  // namespace bushd::test
