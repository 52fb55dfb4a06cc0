#include "sim/qemu/qemu_mcu.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include "engine/message.h"
#include "sim/qemu/qemu_fixture.h"

namespace bushd::sim {
namespace {

TEST(QemuThatEnds, SaysWhy) {
  struct Nobody : Mcu::Driver {
    void transmit(std::size_t, TimeNs, const std::uint8_t*, std::size_t) override {}
  } nobody;
  QemuOptions options;
  options.image = "/nowhere.elf";
  QemuMcu mcu(options, 0, nobody, nullptr);
  try {
    mcu.advance(1'000'000);
    ADD_FAILURE() << "it runs";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/nowhere.elf"));
  }
}

class QemuImage : public QemuAlone {
 protected:
  // `ticks` of two steps each, from a rest.
  void move(std::uint8_t motor, std::size_t ticks) {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
    ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 10'000, {400, 300, 200}, 128));
    ASSERT_NO_FATAL_FAILURE(master_.assign(kAddress, motor, 0));
    master_.fine_ticks(kAddress, motor, master_.poll(kAddress).tick + 20,
                       std::vector<std::int16_t>(ticks, 512));
  }

  void pass_ticks(int ticks) { pass(TimeNs{kTickNs} * ticks); }
};

// The edges of two runs are those of one: see below.
class QemuRuns : public QemuImage {
 protected:
  std::vector<std::pair<TimeNs, int>> edges() {
    move(5, 30);
    pass_ticks(60);
    std::vector<std::pair<TimeNs, int>> out;
    for (const Edge& edge : recorder_.edges) out.emplace_back(edge.time_ns, edge.index);
    return out;
  }
};

TEST_F(QemuRuns, AreTheSameToTheNanosecond) {
  struct Another : QemuRuns {
    Another() { SetUp(); }
    void TestBody() override {}
    using QemuRuns::edges;
  };
  const auto first = edges();
  EXPECT_EQ(first.size(), 1u + 1u + 120u);
  Another again;
  EXPECT_EQ(again.edges(), first);
}

TEST_F(QemuImage, ComesBackWhenItsTicksStandStill) {
  ASSERT_NO_FATAL_FAILURE(move(2, 100));
  pass_ticks(50);
  EXPECT_EQ(master_.poll(kAddress).reset_cause, BUSHD_RESET_POWER_ON);
  const std::size_t steps = steps_made(2);
  EXPECT_GT(steps, 10u);
  qemu_->stop_ticks();
  pass_ticks(80);
  EXPECT_LE(steps_made(2), steps + 4);
  EXPECT_EQ(recorder_.times(0, Signal::kEnable, 0, false).size(), 1u);
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.boot_number, kBoots + 2);
  EXPECT_EQ(report.reset_cause, BUSHD_RESET_WATCHDOG);
}

TEST_F(QemuImage, ReadsItsInputsAndTheSupplyCurrent) {
  qemu_->set_inputs({0x8421, BUSHD_INPUT_FORWARD | BUSHD_INPUT_TRIGGER});
  qemu_->set_current(345);
  pass_ticks(3);
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.inputs, 0x8421);
  EXPECT_EQ(report.system_inputs, BUSHD_INPUT_FORWARD | BUSHD_INPUT_TRIGGER);
  EXPECT_EQ(report.current, 345);
}

// While it hears and answers: other interrupts make pulses begin late.
TEST_F(QemuImage, PulsesLastAsLongAsItHasTakenOnToMakeThem) {
  constexpr std::uint32_t kLongTickNs = 2'610'000;
  constexpr std::uint8_t kMotor = 12;
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(kLongTickNs, BUSHD_FORMAT_FINE));
  const auto takes_on = [this](std::uint8_t pulse_us) {
    bushd_emission settings{};
    settings.pulse_us = pulse_us;
    return master_.acknowledged(kAddress, settings);
  };
  std::uint8_t pulse_us = 12;
  while (pulse_us > 0 && takes_on(pulse_us) != BUSHD_OK) --pulse_us;
  ASSERT_GT(pulse_us, 0);
  ASSERT_EQ(takes_on(0), BUSHD_OK);
  ASSERT_EQ(takes_on(pulse_us), BUSHD_OK);
  ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 1000, {400, 300, 200}, 100));
  ASSERT_NO_FATAL_FAILURE(master_.assign(kAddress, kMotor, 0));
  master_.fine_ticks(kAddress, kMotor, master_.poll(kAddress).tick + 10,
                     std::vector<std::int16_t>(40, 127 * 256));
  for (int i = 0; i < 60; ++i) master_.poll(kAddress);
  const auto up = recorder_.times(0, Signal::kStep, kMotor, true);
  const auto down = recorder_.times(0, Signal::kStep, kMotor, false);
  ASSERT_EQ(up.size(), 40u * 127u);
  ASSERT_EQ(down.size(), up.size());
  TimeNs shortest_ns = kNever;
  for (std::size_t i = 0; i < up.size(); ++i) {
    shortest_ns = std::min(shortest_ns, down[i] - up[i]);
  }
  EXPECT_GE(shortest_ns, pulse_us * 1000);
}

// A page of its journal has 256 words, 5 of them for what the MCU is; it turns before all are used.
class QemuFullJournal : public QemuAlone {
 protected:
  static constexpr std::uint16_t kRecorded = 209;
  QemuFullJournal() : QemuAlone(kBaud, image_path(kBaud), kRecorded) {}
};

TEST_F(QemuFullJournal, CountsItsBootsWhenItTurnsAPage) {
  constexpr int kMore = 45;
  static_assert(5 + kRecorded + 1 + kMore > 256);
  for (int i = 0; i < kMore; ++i) reboot(40'000'000);
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.boot_number, kBoots + 1 + kMore);
  EXPECT_EQ(report.reset_cause, BUSHD_RESET_EXTERNAL);
}

// The same image with one bit of a vector turned round that is never taken: the debug monitor's.
class QemuDamagedImage : public QemuAlone {
 protected:
  QemuDamagedImage() : QemuAlone(kBaud, damaged()) {}

  static std::string damaged() {
    std::ifstream in(image_path(kBaud), std::ios::binary);
    std::string bytes(std::istreambuf_iterator<char>(in), {});
    // The ELF file's first segment is the flash memory, which begins with the vectors.
    const std::size_t segment = bushd_get_u32(bytes_at(bytes, 28));
    const std::size_t flash = bushd_get_u32(bytes_at(bytes, segment + 4));
    bytes.at(flash + std::size_t{4} * 12) ^= 0x10;
    std::string path = testing::TempDir() + "bushd-damaged.elf";
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }

  static const std::uint8_t* bytes_at(const std::string& bytes, std::size_t at) {
    return reinterpret_cast<const std::uint8_t*>(&bytes.at(at));
  }
};

TEST_F(QemuDamagedImage, IsFoundAtBoot) {
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.faults, BUSHD_FAULT_SELF_TEST);
  EXPECT_EQ(report.failed_tests, BUSHD_TEST_FLASH);
}

struct Defect {
  const char* name;
  void (*begin)(QemuMcu& qemu);
  std::uint8_t faults;
  std::uint8_t failed_tests;
};

class QemuDefects : public QemuAlone, public testing::WithParamInterface<Defect> {
 protected:
  QemuDefects() { GetParam().begin(*qemu_); }
};
INSTANTIATE_TEST_SUITE_P(
    Of, QemuDefects,
    testing::Values(
        // In what would be a part of its stack.
        Defect{"Ram", [](QemuMcu& qemu) { qemu.stick_ram(0x2000F004); }, BUSHD_FAULT_SELF_TEST,
               BUSHD_TEST_RAM},
        Defect{"Inputs", [](QemuMcu& qemu) { qemu.stick_inputs(); }, BUSHD_FAULT_SELF_TEST,
               BUSHD_TEST_INPUTS},
        // The next boot would have the same number: nobody could tell it from this one.
        Defect{"WornFlash", [](QemuMcu& qemu) { qemu.wear_flash(); }, BUSHD_FAULT_EEPROM,
               BUSHD_TEST_EEPROM}),
    [](auto& defect) { return defect.param.name; });

TEST_P(QemuDefects, AreFoundAtBoot) {
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.faults, GetParam().faults);
  EXPECT_EQ(report.failed_tests, GetParam().failed_tests);
  EXPECT_EQ(report.boot_number, kBoots + 1);
}

TEST_F(QemuImage, HasNoFaultAndNoActiveInputWhenItIsWhole) {
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.inputs, 0);
  EXPECT_EQ(report.system_inputs, 0);
  EXPECT_EQ(report.faults, 0);
  EXPECT_EQ(report.failed_tests, 0);
}

TEST(QemuMcu, SaysSoIfThereIsNoImage) {
  Recorder recorder;
  Bus bus(500'000, &recorder);
  bus.add_mcu(mcu_of<QemuMcu>(QemuOptions{.image = "/nowhere.elf"}));
  EXPECT_THROW(bus.advance_to(1'000'000), std::runtime_error);
}

}  // namespace
}  // namespace bushd::sim
