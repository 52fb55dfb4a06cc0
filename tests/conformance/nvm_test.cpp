// Tables and settings that an image keeps over resets. Its virtual twin keeps nothing.
#include "conformance/targets.h"
#include "engine/program.h"
#include "sim/mcu_alone.h"

namespace bushd::sim::nvm_test {
namespace {

constexpr std::size_t kCodes = 3;

class Nvm : public McuAlone, public testing::WithParamInterface<Target> {
 protected:
  Nvm() : McuAlone(kBaud, 300'000'000), real_(GetParam().make()) {
    bus_.add_mcu([this](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
      return real_->make({kAddress, 1, 6}, index, driver, sink);
    });
    master_.patience_ns = 20'000'000;  // the CRC of a long table takes a while
  }
  void TearDown() override { real_->expect_unharmed(); }

  void make_ready() {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
    ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 10'000, {400, 300, 200}, 150));
    ASSERT_NO_FATAL_FAILURE(master_.assign(kAddress, 3, 0));
  }

  void make_ready_and_kept() {
    ASSERT_NO_FATAL_FAILURE(make_ready());
    pass(real_->keeps_within_ns(kCodes));
  }

  // By the table in bank 0, once it is brought up; and it has made no step but these, and those
  // made `before`.
  void expect_motor_3_runs(std::size_t before = 0) {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
    ASSERT_NO_FATAL_FAILURE(master_.assign(kAddress, 3, 0));
    run(3, 50);
    pass(200 * TimeNs{kTickNs});
    EXPECT_EQ(steps_made(3) - before, 50u);
  }

  template <class Message>
  bushd_status ask(const Message& message) {
    return master_.acknowledged(kAddress, message);
  }

  const std::unique_ptr<McuUnderTest> real_;
};
BUSHD_FOR_TARGETS(Nvm, targets());

TEST_P(Nvm, TablesAndSettingsOutliveAReset) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  const std::vector<std::uint16_t> ramp = falling_codes(2000, 900);
  ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 5, 10'000, ramp, 1100));
  bushd_set_inputs inputs{};
  inputs.system_inverted = BUSHD_INPUT_FORWARD;
  inputs.limit_negative = 1 << 4;
  ASSERT_EQ(ask(inputs), BUSHD_OK);
  const auto limit = static_cast<std::uint8_t>(13 % real_->twin().motors);
  ASSERT_EQ(ask(bushd_motor_inputs{4, 4, limit, 4}), BUSHD_OK);
  const bushd_tables before = master_.tables(kAddress);
  pass(real_->keeps_within_ns(ramp.size()));
  reboot();
  const bushd_tables after = master_.tables(kAddress);
  for (std::size_t bank = 0; bank < BUSHD_TABLE_BANKS; ++bank) {
    EXPECT_EQ(after.bank[bank].valid, bank == 0 || bank == 5);
    EXPECT_EQ(after.bank[bank].crc, before.bank[bank].crc);
    EXPECT_EQ(after.bank[bank].revision, before.bank[bank].revision);
  }
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.faults, 0);
  EXPECT_EQ(report.system_inputs, BUSHD_INPUT_FORWARD);
  EXPECT_EQ(report.forbidden_negative, 0);
  bus_.node(0).set_inputs({static_cast<std::uint16_t>(1u << limit), 0});
  pass(4 * TimeNs{kTickNs});
  EXPECT_EQ(master_.poll(kAddress).forbidden_negative, 1 << 4);
  bus_.node(0).set_inputs({});

  // And they move motors.
  expect_motor_3_runs();
}

TEST_P(Nvm, LocalInputsMoveMotorsAfterAResetWithoutAHost) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  ASSERT_EQ(ask(bushd_local{1 << 3, 0, 0}), BUSHD_OK);
  pass(real_->keeps_within_ns(kCodes));
  reboot();
  bus_.node(0).set_inputs({0, BUSHD_INPUT_REVERSE});
  pass(100 * TimeNs{kTickNs});
  const std::size_t held = steps_made(3);
  EXPECT_GT(held, 100u) << "1.5 ms a step";
  bus_.node(0).set_inputs({0, 0});
  pass(20 * TimeNs{kTickNs});
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.moving, 0);
  EXPECT_EQ(report.motor[3].position_steps, -static_cast<std::int32_t>(steps_made(3)));
  EXPECT_LT(steps_made(3), held + 10);
  EXPECT_EQ(steps_made(4), 0u);
}

// EN of drivers that are enabled by a low level, and STEP that rests high: before anybody speaks.
TEST_P(Nvm, LevelsOfOutputsOutliveAReset) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  ASSERT_EQ(ask(bushd_set_outputs{0x0008, 0, BUSHD_ENABLED_LOW}), BUSHD_OK);
  pass(real_->keeps_within_ns(kCodes));
  recorder_.edges.clear();
  reboot();
  const auto level_of = [this](Signal signal, std::uint8_t index) {
    bool level = false;
    for (const Edge& edge : recorder_.edges) {
      if (edge.signal == signal && edge.index == index) level = edge.level;
    }
    return level;
  };
  EXPECT_TRUE(level_of(Signal::kEnable, 0));
  EXPECT_TRUE(level_of(Signal::kStep, 3));
  EXPECT_FALSE(level_of(Signal::kStep, 4));
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
  EXPECT_FALSE(level_of(Signal::kEnable, 0));
  // Rising edges: here, ends of pulses.
  expect_motor_3_runs(steps_made(3));
}

class NvmVelocity : public Nvm {};
BUSHD_FOR_TARGETS(NvmVelocity, targets_with(BUSHD_CAN_VELOCITY));

// Without a table, too.
TEST_P(NvmVelocity, LocalInputsMoveAMotorAfterAResetWithoutAHost) {
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
  ASSERT_EQ(ask(bushd_set_velocity{1, 200 * 64, 1000 * 64, 2000}), BUSHD_OK);
  ASSERT_EQ(ask(bushd_local{1 << 1, 0, 0}), BUSHD_OK);
  pass(real_->keeps_within_ns(kCodes));
  reboot();
  bus_.node(0).set_inputs({0, BUSHD_INPUT_REVERSE});
  pass(400 * TimeNs{kTickNs});
  bus_.node(0).set_inputs({0, 0});
  pass(250 * TimeNs{kTickNs});
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.moving, 0);
  EXPECT_EQ(report.motor[1].position_steps, -static_cast<std::int32_t>(steps_made(1)));
  // 0.5 s at 500 steps/s on the average, each way, 0.517 s of full speed, and 20 steps more where
  // 200 steps/s are more than the ramp; updates are 15.6 ms apart, 15 steps at full speed.
  EXPECT_NEAR(static_cast<double>(steps_made(1)), 500 + 517 + 20, 30);
}

TEST_P(Nvm, WhatIsTheSameIsNotWrittenAgain) {
  ASSERT_NO_FATAL_FAILURE(make_ready_and_kept());
  const std::uint64_t written = real_->nvm_writes();
  EXPECT_GT(written, 20u);
  pass(real_->keeps_within_ns(kCodes));
  EXPECT_EQ(real_->nvm_writes(), written);
  ASSERT_NO_FATAL_FAILURE(make_ready_and_kept());
  EXPECT_EQ(real_->nvm_writes(), written);
}

class NvmProgram : public Nvm {
 protected:
  // By 70 steps, and 30 back.
  static Bytes program(std::uint8_t flags) {
    Bytes bytes = {BUSHD_PROGRAM_FORMAT, flags, 1 << 3, 0, 0};
    const auto append = [&bytes](std::int32_t value, int size) {
      for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
    };
    append(-5, 4);
    append(70, 4);
    for (const std::int32_t steps : {70, -30}) {
      bytes.push_back(BUSHD_PROGRAM_MOVE_BY);
      append(1 << 3, 2);
      append(steps, 4);
      append(0, 2);
    }
    bytes.push_back(BUSHD_PROGRAM_END);
    return bytes;
  }
  void load(const Bytes& bytes) {
    Bytes part = {0, 0, static_cast<std::uint8_t>(bytes.size()), 0};
    part.insert(part.end(), bytes.begin(), bytes.end());
    ASSERT_EQ(master_.acknowledged(kAddress, BUSHD_MSG_PROGRAM_PUT, part), BUSHD_OK);
    const std::uint32_t crc = ~bushd_crc32(BUSHD_CRC32_START, bytes.data(), bytes.size());
    ASSERT_EQ(control(BUSHD_PROGRAM_COMMIT, crc), BUSHD_OK);
  }
  bushd_status control(std::uint8_t action, std::uint32_t value) {
    return ask(bushd_program_control{action, 0, value});
  }
  bushd_program_state state() { return master_.program_state(kAddress); }
};
BUSHD_FOR_TARGETS(NvmProgram, targets_with(BUSHD_CAN_PROGRAM));

TEST_P(NvmProgram, AProgramOutlivesAResetAndBeginsWhenThePowerComes) {
  ASSERT_NO_FATAL_FAILURE(make_ready_and_kept());
  const Bytes bytes =
      program(BUSHD_PROGRAM_WITHOUT_HOST | BUSHD_PROGRAM_KEPT | BUSHD_PROGRAM_AT_POWER_ON);
  ASSERT_NO_FATAL_FAILURE(load(bytes));
  EXPECT_EQ(state().flags & BUSHD_PROGRAM_STORED, 0);
  pass(real_->keeps_within_ns(kCodes));
  EXPECT_NE(state().flags & BUSHD_PROGRAM_STORED, 0);
  reboot();
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_LOADED) << "its power was not off";
  pass(1'500'000'000);
  EXPECT_EQ(steps_made(3), 0u);
  ASSERT_TRUE(real_->power_comes_back_next());
  reboot();
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_RUNS);
  EXPECT_EQ(steps_made(3), 0u) << "not before a second has passed";
  pass(2'000'000'000);
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_ENDED);
  EXPECT_EQ(state().reason, BUSHD_PROGRAM_DONE);
  EXPECT_EQ(steps_made(3), 100u);
  EXPECT_EQ(master_.poll(kAddress).motor[3].position_steps, 40);
  ASSERT_EQ(control(BUSHD_PROGRAM_ERASE, 0), BUSHD_OK);
  EXPECT_EQ(state().flags & BUSHD_PROGRAM_STORED, 0) << "a reset would bring it back";
  pass(real_->keeps_within_ns(kCodes));
  EXPECT_NE(state().flags & BUSHD_PROGRAM_STORED, 0);
  ASSERT_TRUE(real_->power_comes_back_next());
  reboot();
  EXPECT_EQ(state().stage, BUSHD_PROGRAM_NONE);
}

// Bank 8, which is never kept, whether the MCU has it or refuses it.
class NvmScratch : public Nvm {
 protected:
  void SetUp() override {
    Nvm::SetUp();
    ASSERT_NO_FATAL_FAILURE(make_ready_and_kept());
    written_ = real_->nvm_writes();
    before_ = master_.tables(kAddress);
  }

  // What was kept before is there after a reset, nothing was written, and bank 8 is empty.
  void expect_only_the_other_table_is_kept() {
    pass(real_->keeps_within_ns(kCodes));
    EXPECT_EQ(real_->nvm_writes(), written_);
    reboot();
    const bushd_tables after = master_.tables(kAddress);
    for (std::size_t bank = 0; bank < BUSHD_TABLE_BANKS; ++bank) {
      EXPECT_EQ(after.bank[bank].valid, bank == 0);
      EXPECT_EQ(after.bank[bank].crc, before_.bank[bank].crc);
    }
    EXPECT_EQ(master_.poll(kAddress).faults, 0);
    EXPECT_NE(ask(bushd_table_end{BUSHD_SCRATCH_BANK, 0}), BUSHD_OK);
    expect_motor_3_runs();
  }

 private:
  std::uint64_t written_ = 0;
  bushd_tables before_{};
};
BUSHD_FOR_TARGETS(NvmScratch, targets_with(BUSHD_CAN_SCRATCH));

TEST_P(NvmScratch, ATableForLinesIsNotKeptAndLeavesTheOthersAlone) {
  ASSERT_NO_FATAL_FAILURE(
      master_.upload_table(kAddress, BUSHD_SCRATCH_BANK, 10'000, falling_codes(2000, 900), 1100));
  expect_only_the_other_table_is_kept();
}

class DeniedNvmScratch : public NvmScratch {};
BUSHD_FOR_TARGETS(DeniedNvmScratch, targets_without(BUSHD_CAN_SCRATCH));

TEST_P(DeniedNvmScratch, ATableForLinesIsRefusedAndLeavesTheOthersAlone) {
  const bushd_table_begin begin{BUSHD_SCRATCH_BANK, 3, 0, 150, 10'000, 1};
  EXPECT_EQ(ask(begin), BUSHD_E_FORMAT);
  expect_only_the_other_table_is_kept();
}

TEST_P(Nvm, ABitThatHasFlippedIsAFault) {
  ASSERT_NO_FATAL_FAILURE(make_ready_and_kept());
  real_->flip_nvm_bit();
  reboot();
  EXPECT_EQ(master_.poll(kAddress).faults, BUSHD_FAULT_EEPROM);
  EXPECT_EQ(master_.valid_tables(kAddress), 0u);
  // It is mended when there is something to keep again.
  ASSERT_EQ(ask(bushd_control{BUSHD_CONTROL_CLEAR_FAULTS, 0}), BUSHD_OK);
  ASSERT_NO_FATAL_FAILURE(make_ready_and_kept());
  reboot();
  EXPECT_EQ(master_.poll(kAddress).faults, 0);
  EXPECT_EQ(master_.valid_tables(kAddress), 1u);
}

}  // namespace
}  // namespace bushd::sim::nvm_test
