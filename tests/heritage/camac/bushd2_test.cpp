// BUSHD-2. What the report of 1985 says, by the numbers of docs/camac.md, is in the names' order
// there.
#include "heritage/camac/bushd2.h"

#include <gtest/gtest.h>

#include "heritage/camac/bench.h"
#include "tables/table.h"

namespace bushd::camac::bushd2_test {
namespace {

constexpr std::uint32_t kEnableAddress = 0x10;  // bit 5, also of the motor's number
constexpr std::uint32_t kEnableMotor = 0x20;
constexpr std::uint32_t kEnableEnd = 0x40;
constexpr std::uint32_t kLeft = 0x80;
constexpr std::uint32_t kStepDone = 0x10;

class Bushd2Bench : public Commands<Bushd2> {
 public:
  Bushd2Bench() : module(motors) { crate.insert(kStation, module); }
  // A program of `steps` in its page, with codes that fall from 250 to 10.
  void load(int page, int steps) {
    std::vector<int> bytes{steps % 256, steps / 256};
    for (std::size_t i = 0; i < Bushd2::kCodes; ++i) bytes.push_back(250 - static_cast<int>(i));
    for (int& byte : bytes) byte = std::max(byte, 0);
    write_at(static_cast<std::uint32_t>(page) * Bushd2::kPageBytes, bytes);
  }
  void answer(std::uint32_t steps, const MotorStatus& status = {}) { module.answer(steps, status); }

  MotorsBench motors;
  Bushd2 module;
};

TEST(Bushd2, RunsWithoutTheComputer) {  // S1, S24
  Bushd2Bench bench;
  bench.load(0, 3);
  bench.permit(kEnableEnd);
  ASSERT_EQ(bench.motors.moves.size(), 1U);
  bench.answer(1);
  bench.answer(1);
  EXPECT_EQ(bench.crate.requests(), 0U);
  bench.answer(1);
  EXPECT_EQ(bench.crate.requests(), 1U << (bench.kStation - 1));
  EXPECT_TRUE(bench.motors.stops.empty());
}

TEST(Bushd2, OtherMotorsTakeOtherTableContents) {  // S2
  Bushd2Bench bench;
  bench.write_at(0, {5, 0, 200, 100, 50});
  bench.permit();
  ASSERT_EQ(bench.motors.moves.size(), 1U);
  EXPECT_EQ(bench.motors.moves[0].codes[2], 50);
  bench.answer(5);
  bench.write_at(2, {90, 80, 70});
  bench.permit();
  ASSERT_EQ(bench.motors.moves.size(), 2U);
  EXPECT_EQ(bench.motors.moves[1].codes[2], 70);
}

TEST(Bushd2, AnswersElevenCommands) {  // S4, S6, S19 (the commands of BUSHD-1), U5
  Bushd2Bench bench;
  bench.set_control(0xA5);
  bench.set_address(0x3FF);
  EXPECT_EQ(text(bench.cycle(1, 0)), "X Q 1023");
  EXPECT_EQ(text(bench.cycle(0, 0)), "X Q 0");
  EXPECT_EQ(text(bench.cycle(1, 0)), "X Q 0");
  EXPECT_EQ(text(bench.cycle(2, 0)), "X Q 165");
  EXPECT_EQ(text(bench.cycle(3, 0)), "X Q 0");
  EXPECT_EQ(text(bench.cycle(0, 8)), "X - 0");
  EXPECT_EQ(text(bench.cycle(0, 10)), "X - 0");
  EXPECT_EQ(text(bench.cycle(0, 16, 0xFFFF42)), "X Q 0");
  EXPECT_EQ(text(bench.cycle(1, 16, 0xFFFC00)), "X Q 0");
  EXPECT_EQ(text(bench.cycle(0, 0)), "X Q 66");
  EXPECT_EQ(text(bench.cycle(2, 16, 0xFFFF00)), "X Q 0");
  EXPECT_EQ(text(bench.cycle(0, 24)), "X - 0");
  EXPECT_EQ(text(bench.cycle(0, 26)), "X - 0");
  int accepted = 0;
  for (int a = 0; a < 16; ++a) {
    for (int f = 0; f < 32; ++f) {
      const Response response = bench.cycle(a, f);
      accepted += response.x ? 1 : 0;
      if (response.x) continue;
      EXPECT_EQ(text(response), "- - 0") << "A" << a << " F" << f;
    }
  }
  EXPECT_EQ(accepted, 11);
}

TEST(Bushd2, QOfMemoryIsNotLam) {  // S5, U1, U4
  Bushd2Bench bench;
  bench.set_control(kEnableAddress);
  bench.set_address(1023);
  EXPECT_TRUE(bench.cycle(0, 16, 7).q) << "the cycle that overflows answers by the LAM before it";
  EXPECT_TRUE(bench.lam());
  EXPECT_FALSE(bench.cycle(0, 16, 8).q);
  EXPECT_EQ(bench.address(), 1U) << "written and counted all the same";
  bench.set_address(0);
  EXPECT_TRUE(bench.lam()) << "writing the address register does not clear it";
  EXPECT_EQ(text(bench.read()), "X - 8");
  bench.clear_lam();
  EXPECT_FALSE(bench.lam());
  EXPECT_TRUE(bench.read().q);
}

TEST(Bushd2, MovesTheGivenNumberOfSteps) {  // S19, S25: the number at addresses 0 and 1
  Bushd2Bench bench;
  bench.load(0, 65535);
  bench.permit();
  EXPECT_EQ(bench.motors.moves.at(0).steps, 65535U);
  bench.answer(65534);
  EXPECT_TRUE(bench.module.is_moving());
  bench.answer(1);
  EXPECT_FALSE(bench.module.is_moving());
}

TEST(Bushd2, HoldsFourProgramsAndThePositionsOfMotors) {  // S20, S28, U19
  Bushd2Bench bench;
  for (int page = 0; page < 4; ++page) bench.load(page, 10 * (page + 1));
  bench.write_at(240, {1, 2});
  for (int motor = 0; motor < 32; ++motor) {
    bench.permit(static_cast<std::uint32_t>(motor));
    const Program& program = bench.motors.moves.back();
    EXPECT_EQ(program.motor, motor);
    EXPECT_EQ(program.page, motor / 8);
    EXPECT_EQ(program.steps, 10U * static_cast<unsigned>(motor / 8 + 1));
    bench.answer(program.steps);
  }
  EXPECT_EQ(bench.motors.moves.size(), 32U);
  // U28: page and place of the motor, and what a program has put there counts.
  for (std::uint32_t motor = 0; motor < 32; ++motor) {
    const std::uint32_t page = motor / 8;
    bench.set_address(page * 256 + 240 + motor % 8 * 2);
    const std::uint32_t low = bench.read().data;
    const std::uint32_t before = motor == 0 ? 0x0201 : 0;
    EXPECT_EQ(low + 256 * bench.read().data, before + 10 * (page + 1)) << motor;
  }
}

TEST(Bushd2, CountsThePositionOfItsMotorUpAndDown) {  // S20, U28
  Bushd2Bench bench;
  bench.load(0, 300);
  const auto position = [&] {
    bench.set_address(246);
    const std::uint32_t low = bench.read().data;
    return low + 256 * bench.read().data;
  };
  bench.permit(3);
  bench.answer(100);
  EXPECT_EQ(position(), 100U) << "as statuses come";
  bench.answer(200);
  EXPECT_EQ(position(), 300U);
  bench.permit(3 | kLeft);
  bench.answer(300);
  EXPECT_EQ(position(), 0U);
  bench.permit();
  bench.answer(1);
  EXPECT_EQ(position(), 65535U) << "below 0 it goes on from the top";
  bench.forbid();
  bench.module.ends({}, 2);
  EXPECT_EQ(position(), 65533U) << "steps of the ramp-down too, which no status has told";
  bench.module.ends({}, 2);
  EXPECT_EQ(position(), 65533U) << "nothing moves";
  bench.crate.initialise();
  EXPECT_EQ(position(), 65533U);
}

TEST(Bushd2, SendsNumberDirectionAndCodes) {  // S21, S30, U7
  Bushd2Bench bench;
  bench.load(1, 4);
  bench.permit(13 | kLeft);
  const Program& program = bench.motors.moves.at(0);
  EXPECT_EQ(program.motor, 13);
  EXPECT_EQ(program.motor % Bushd2::kMotorsPerPage, 5) << "the channel of its commutator";
  EXPECT_TRUE(program.left);
  EXPECT_EQ(program.codes.size(), Bushd2::kCodes);
}

TEST(Bushd2, ReceivesTheStatusAfterEachStep) {  // S22, S27, S34, U23
  Bushd2Bench bench;
  bench.load(0, 6);
  bench.permit();
  EXPECT_EQ(bench.requests(), 0U);
  for (std::uint32_t step = 1; step <= 6; ++step) {
    bench.answer(1);
    EXPECT_EQ(bench.requests(), kStepDone | (step % 4) << 8);
  }
}

TEST(Bushd2, WatchesStepsAndState) {  // S24: PU
  Bushd2Bench bench;
  bench.load(0, 6);
  bench.permit(kEnableMotor);
  bench.answer(1);
  EXPECT_FALSE(bench.lam());
  bench.module.ends({.not_connected = true});
  EXPECT_TRUE(bench.lam());
  EXPECT_EQ(bench.requests() & 0xFF, 8U);
  EXPECT_FALSE(bench.module.is_moving());
}

// D3, mode 1 and mode 2 of the report, and the rule of tables (engine/table.h), are one.
TEST(Bushd2, ModesDependOnTheNumberOfSteps) {  // S25
  Program program;
  for (std::size_t i = 0; i < Bushd2::kCodes; ++i) {
    program.codes.push_back(static_cast<std::uint8_t>(std::max<std::size_t>(250 - i, 10)));
  }
  tables::TableContent content{.name = "p", .time_unit_ns = 100'000};
  content.accel.assign(program.codes.begin(), program.codes.end());
  const auto table = tables::make(content);
  ASSERT_TRUE(table) << table.error().text();
  for (const std::uint32_t steps : {1U, 2U, 3U, 7U, 237U, 474U, 475U, 476U, 477U, 1001U, 65535U}) {
    program.steps = steps;
    for (std::uint32_t step = 0; step < steps; ++step) {
      const std::uint8_t code = code_of_step(program, step);
      const std::uint32_t stops = steps - 1 - step;
      if (step < 238 && step <= stops) {
        EXPECT_EQ(code, program.codes[step]) << "accelerates";
      } else if (stops < 238) {
        EXPECT_EQ(code, program.codes[stops]) << "stops";
      } else {
        EXPECT_EQ(code, program.codes.back()) << "F_max";
      }
      ASSERT_EQ(code, bushd_table_delay(&(*table)->view(), step + 1, steps))
          << steps << ":" << step;
    }
  }
}

TEST(Bushd2, ControlRegisterBits) {  // S26
  Bushd2Bench bench;
  bench.load(0, 2);
  bench.load(3, 2);
  bench.permit(0x1F | kLeft);
  EXPECT_EQ(bench.motors.moves.back().motor, 31);
  EXPECT_TRUE(bench.motors.moves.back().left);
  bench.answer(2);
  EXPECT_FALSE(bench.lam()) << "bit 7";
  bench.set_control(kEnableEnd);
  EXPECT_TRUE(bench.lam()) << "U3: a disabled request raises L when it is enabled";
  bench.clear_lam();
  bench.set_control(0);
  bench.motors.statuses[0].supply_missing = true;
  bench.permit();
  EXPECT_FALSE(bench.lam()) << "bit 6";
  bench.set_control(kEnableMotor);
  EXPECT_TRUE(bench.lam());
  bench.clear_lam();
  EXPECT_FALSE(bench.lam()) << "U2: the cause is still present";
}

TEST(Bushd2, AddressOverflowIsSilentInMotion) {  // S26: bit 5, U20
  Bushd2Bench bench;
  bench.load(2, 3);
  bench.permit(kEnableAddress);  // motor 16
  bench.set_address(1023);
  bench.write(0);
  EXPECT_FALSE(bench.lam());
  bench.answer(3);
  EXPECT_TRUE(bench.lam());
}

TEST(Bushd2, MotorsMoveOneAfterAnother) {  // S28, U16
  Bushd2Bench bench;
  bench.load(0, 3);
  bench.permit();
  bench.permit(1);
  EXPECT_EQ(bench.motors.moves.size(), 1U);
  bench.answer(3);
  bench.permit();
  EXPECT_EQ(bench.motors.moves.size(), 2U);
}

TEST(Bushd2, StateOfTheMotorEndsTheMotion) {  // S33, U23
  struct Case {
    MotorStatus status;
    std::uint32_t bits;
    bool bars_right;
    bool bars_left;
  };
  const Case cases[]{{{.right_limit = true}, 1, true, false},
                     {{.left_limit = true}, 2, false, true},
                     {{.supply_missing = true}, 4, true, true},
                     {{.not_connected = true}, 8, true, true}};
  for (const Case& each : cases) {
    for (const bool left : {false, true}) {
      const bool barred = left ? each.bars_left : each.bars_right;
      Bushd2Bench bench;
      bench.load(0, 5);
      bench.permit(kEnableMotor | (left ? kLeft : 0));
      bench.answer(2, each.status);
      EXPECT_EQ(bench.lam(), barred) << each.bits;
      EXPECT_EQ(bench.module.is_moving(), !barred);
      EXPECT_EQ(bench.requests(), each.bits | kStepDone | 2U << 8);

      Bushd2Bench before;
      before.load(0, 5);
      before.motors.statuses[0] = each.status;
      before.permit(left ? kLeft : 0);
      EXPECT_EQ(before.motors.moves.empty(), barred);
      EXPECT_EQ(before.requests(), barred ? each.bits | 1U << 8 : 0);
    }
  }
}

TEST(Bushd2, ForbidStopsWithoutARequest) {  // S4: F24A0, U16
  Bushd2Bench bench;
  bench.load(0, 5);
  bench.permit(kEnableMotor | kEnableEnd);
  bench.answer(2);
  bench.forbid();
  bench.forbid();
  EXPECT_EQ(bench.motors.stops, std::vector<int>{0});
  bench.permit();
  EXPECT_EQ(bench.motors.moves.size(), 1U) << "it does not stand yet";
  bench.answer(1);
  bench.module.ends({});
  EXPECT_FALSE(bench.lam());
  bench.permit();
  EXPECT_EQ(bench.motors.moves.size(), 2U);
}

TEST(Bushd2, AMotionThatSomebodyElseEndsIsAFault) {
  Bushd2Bench bench;
  bench.load(0, 5);
  bench.permit(kEnableMotor);
  bench.answer(2);
  bench.module.ends({});
  EXPECT_TRUE(bench.lam());
  EXPECT_EQ(bench.requests(), kStepDone | 2U << 8) << "nothing was received that says why";
}

TEST(Bushd2, AProgramThatCannotBeMadeIsAFault) {
  Bushd2Bench bench;
  bench.load(0, 5);
  bench.set_control(kEnableMotor);
  bench.motors.accepts = false;
  bench.permit();
  EXPECT_TRUE(bench.lam());
  EXPECT_FALSE(bench.module.is_moving());
  EXPECT_EQ(bench.requests(), 0U) << "no motor has told a status";
}

TEST(Bushd2, MotorAndDirectionAreLatchedEnablesAreNot) {  // U17
  Bushd2Bench bench;
  bench.load(0, 5);
  bench.permit(3);
  bench.set_control(9 | kLeft | kEnableEnd);
  bench.set_address(77);
  bench.answer(5);
  EXPECT_EQ(bench.motors.moves.at(0).motor, 3);
  EXPECT_FALSE(bench.motors.moves.at(0).left);
  EXPECT_TRUE(bench.lam());
  EXPECT_EQ(bench.address(), 77U);
}

TEST(Bushd2, NoStepsEndAtOnceAndCodeZeroIsOne) {  // U25
  Bushd2Bench bench;
  bench.permit(kEnableEnd);
  EXPECT_TRUE(bench.lam());
  EXPECT_TRUE(bench.motors.moves.empty());
  bench.write_at(0, {1});
  bench.permit();
  EXPECT_EQ(bench.motors.moves.at(0).codes[0], 1);
}

TEST(Bushd2, InitialiseClearAndInhibit) {  // U18
  Bushd2Bench bench;
  bench.load(0, 5);
  bench.permit(kEnableEnd | 2);
  bench.answer(1);
  bench.crate.initialise();
  EXPECT_EQ(bench.motors.stops, std::vector<int>{2});
  EXPECT_EQ(bench.address(), 0U);
  EXPECT_EQ(bench.control(), 0U);
  EXPECT_EQ(bench.requests(), 0U);
  EXPECT_EQ(bench.read().data, 5U) << "the memory stays";
  bench.module.ends({});

  bench.permit(kEnableEnd);
  bench.answer(5);
  EXPECT_TRUE(bench.lam());
  bench.crate.clear();
  EXPECT_FALSE(bench.lam());
  EXPECT_EQ(bench.requests(), 0U);
  EXPECT_EQ(bench.control(), kEnableEnd);

  bench.permit();
  bench.crate.set_inhibit(true);
  const std::size_t moves = bench.motors.moves.size();
  bench.answer(5);
  EXPECT_TRUE(bench.lam()) << "a motion goes on";
  EXPECT_EQ(text(bench.cycle(0, 26)), "X - 0");
  EXPECT_EQ(bench.motors.moves.size(), moves);
}

TEST(Bushd2, MemoryIsKeptByWhoeverKeepsIt) {
  Bushd2Bench bench;
  bench.load(2, 999);
  Bushd2Bench next;
  next.module.load_memory(bench.module.memory());
  next.permit(17);
  EXPECT_EQ(next.motors.moves.at(0).steps, 999U);
}

}  // namespace
}  // namespace bushd::camac::bushd2_test
