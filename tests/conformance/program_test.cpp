// Programs of an image and of its virtual twin, begun in one tick: the same steps in the same
// slots, also while nobody says a word.
#include "engine/program.h"

#include <vector>

#include "conformance/script.h"

namespace bushd::sim::program_test {
namespace {

void append(Bytes& bytes, std::uint32_t value, int size) {
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}

class ProgramScript : public TargetScript {
 protected:
  static constexpr std::uint8_t kFirst = 1;
  static constexpr std::uint8_t kSecond = 6;
  static constexpr unsigned kMotors = 1u << kFirst | 1u << kSecond;

  // Three times: both along a line to two points, a pulse, a wait, one of them back.
  static Bytes program(std::uint8_t flags) {
    Bytes bytes = {BUSHD_PROGRAM_FORMAT, flags};
    append(bytes, kMotors, 2);
    for (int motor = 0; motor < 2; ++motor) {
      bytes.push_back(0);
      append(bytes, 0u - 5000u, 4);
      append(bytes, 5000, 4);
    }
    for (const std::uint8_t byte : Bytes{8, 3, 0, 3}) bytes.push_back(byte);
    append(bytes, kMotors, 2);
    for (const std::uint8_t byte : Bytes{0, 0, 0, 2, 0}) bytes.push_back(byte);
    for (const std::int32_t steps : {200, -77, 150, 40}) {
      append(bytes, static_cast<std::uint32_t>(steps), 4);
    }
    bytes.push_back(7);
    append(bytes, 4000, 4);
    bytes.push_back(5);
    append(bytes, 30'000, 4);
    bytes.push_back(2);
    append(bytes, 1u << kFirst, 2);
    append(bytes, 0u - 90u, 4);
    append(bytes, 95, 2);
    bytes.push_back(9);
    bytes.push_back(0);
    return bytes;
  }
  void load(const Bytes& bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += 40) {
      Bytes part;
      append(part, static_cast<std::uint32_t>(at), 2);
      append(part, static_cast<std::uint32_t>(bytes.size()), 2);
      const std::size_t end = std::min(at + 40, bytes.size());
      part.insert(part.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                  bytes.begin() + static_cast<std::ptrdiff_t>(end));
      ASSERT_NO_FATAL_FAILURE(ask(BUSHD_MSG_PROGRAM_PUT, part));
    }
    const std::uint32_t crc = ~bushd_crc32(BUSHD_CRC32_START, bytes.data(), bytes.size());
    ASSERT_NO_FATAL_FAILURE(control(BUSHD_PROGRAM_COMMIT, 0, crc));
  }
  void control(std::uint8_t action, std::uint8_t number = 0, std::uint32_t value = 0) {
    ASSERT_NO_FATAL_FAILURE(ask(bushd_program_control{action, number, value}));
  }
  void expect_alike() {
    Script::expect_alike({kFirst, kSecond});
    const bushd_program_state expected = master_.program_state(kVirtual);
    const bushd_program_state told = master_.program_state(kReal);
    EXPECT_EQ(told.stage, expected.stage);
    EXPECT_EQ(told.reason, expected.reason);
    EXPECT_EQ(told.frame, expected.frame);
    EXPECT_EQ(told.point, expected.point);
    EXPECT_EQ(told.repeats, expected.repeats);
    EXPECT_EQ(told.crc, expected.crc);
    EXPECT_EQ(told.memory, expected.memory);
  }
};
BUSHD_FOR_TARGETS(ProgramScript, targets_with(BUSHD_CAN_PROGRAM));

class DeniedProgram : public ProgramScript {};
BUSHD_FOR_TARGETS(DeniedProgram, targets_without(BUSHD_CAN_PROGRAM));

TEST_P(DeniedProgram, IsRefused) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {}));
  EXPECT_EQ(master_.acknowledged(kReal, BUSHD_MSG_PROGRAM_PUT, Bytes{0, 0, 9, 0, 1}),
            BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(master_.acknowledged(kReal, BUSHD_MSG_PROGRAM, Bytes(6)), BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(master_.acknowledged(kReal, BUSHD_MSG_PROGRAM_STATE, Bytes{}), BUSHD_E_UNKNOWN_MESSAGE);
}

TEST_P(ProgramScript, GoesOnInSilenceAsItsTwinDoes) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {kFirst, kSecond}));
  ASSERT_NO_FATAL_FAILURE(load(program(BUSHD_PROGRAM_WITHOUT_HOST)));
  ASSERT_NO_FATAL_FAILURE(control(BUSHD_PROGRAM_RUN, 1, master_.poll(kReal).tick + 40));
  pass_ticks(4000);
  EXPECT_EQ(master_.program_state(kReal).stage, BUSHD_PROGRAM_ENDED);
  EXPECT_EQ(master_.program_state(kReal).reason, BUSHD_PROGRAM_DONE);
  EXPECT_EQ(master_.program_state(kReal).repeats, 3u);
  EXPECT_EQ(master_.poll(kReal).motor[kFirst].position_steps, 150 - 90);
  EXPECT_EQ(master_.poll(kReal).motor[kSecond].position_steps, 40);
  EXPECT_EQ(recorder_.times(1, Signal::kPositionCompare, 0, true).size(), 3u);
  expect_alike();
}

// A move until an input, twice: at once with a ramp-down, then 60 steps after it.
TEST_P(ProgramScript, AnInputEndsAMoveAsAtItsTwin) {
  Bytes bytes = {BUSHD_PROGRAM_FORMAT, 0};
  append(bytes, 1u << kFirst, 2);
  bytes.push_back(0);
  append(bytes, 0u - 5000u, 4);
  append(bytes, 5000, 4);
  for (const std::uint8_t after : {std::uint8_t{0}, std::uint8_t{60}}) {
    bytes.push_back(BUSHD_PROGRAM_MOVE_UNTIL);
    append(bytes, 1u << kFirst, 2);
    for (const std::uint8_t byte :
         {std::uint8_t{kFirst}, static_cast<std::uint8_t>(after == 0 ? 1 : 0), after}) {
      bytes.push_back(byte);
    }
    append(bytes, 0, 3);
    append(bytes, 900, 4);
    append(bytes, 0, 2);
  }
  bytes.push_back(BUSHD_PROGRAM_END);
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {kFirst}));
  ASSERT_NO_FATAL_FAILURE(load(bytes));
  const std::uint32_t first = master_.poll(kReal).tick + 40;
  ASSERT_NO_FATAL_FAILURE(control(BUSHD_PROGRAM_RUN, 1, first));
  // Far enough from the ends of ticks, of which each MCU has its own.
  pass_ticks(80);
  set_inputs({1u << kFirst, 0});
  pass_ticks(60);
  set_inputs({0, 0});
  pass_ticks(200);
  EXPECT_EQ(master_.program_state(kReal).stage, BUSHD_PROGRAM_ENDED);
  EXPECT_EQ(master_.program_state(kReal).reason, BUSHD_PROGRAM_DONE);
  const std::int32_t position = master_.poll(kReal).motor[kFirst].position_steps;
  EXPECT_GT(position, 60);
  EXPECT_LT(position, 1800);
  expect_the_same_steps(kFirst, static_cast<std::size_t>(position));
  expect_the_same_times(kFirst);
}

TEST_P(ProgramScript, StopsOnRequest) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_COARSE, {kFirst, kSecond}));
  ASSERT_NO_FATAL_FAILURE(load(program(0)));
  ASSERT_NO_FATAL_FAILURE(control(BUSHD_PROGRAM_RUN, 1, master_.poll(kReal).tick + 40));
  pass_ticks(40);
  for (int ticks = 0; ticks < 140; ticks += 20) {
    master_.poll(kReal);
    pass_ticks(20);
  }
  ASSERT_NO_FATAL_FAILURE(control(BUSHD_PROGRAM_STOP));
  pass_ticks(150);
  EXPECT_EQ(master_.program_state(kReal).stage, BUSHD_PROGRAM_ENDED);
  EXPECT_EQ(master_.program_state(kReal).reason, BUSHD_PROGRAM_STOPPED);
  // Each was asked in a tick of its own, so what they made differs: the counts are those of the
  // pins.
  for (const std::uint8_t motor : {kFirst, kSecond}) {
    std::int32_t position = 0;
    for (const Step& step : steps(1, motor)) position += step.positive ? 1 : -1;
    EXPECT_EQ(master_.poll(kReal).motor[motor].position_steps, position);
  }
}

}  // namespace
}  // namespace bushd::sim::program_test
