#include "sim/vcd.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>

#include "bus_fixture.h"
#include "vcd_reader.h"

namespace bushd::sim::vcd_test {
namespace {

class Vcd : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path); }

  const std::string path = testing::TempDir() + "bushd_vcd_" +
                           testing::UnitTest::GetInstance()->current_test_info()->name() + ".vcd";
};

TEST_F(Vcd, HeadNamesAllWiresAndGivesTheirFirstValues) {
  auto writer = VcdWriter::create(path, std::array<std::uint8_t, 3>{1, 2, 200});
  ASSERT_TRUE(writer) << writer.error().text();
  ASSERT_TRUE((*writer)->close(1'000'000));
  const VcdFile file = read_vcd(path);
  EXPECT_EQ(file.timescale, "1ns");
  EXPECT_EQ(file.wires.size(), 3u * 37u);
  for (const char* name : {"mcu1.step0", "mcu2.dir15", "mcu200.en"}) {
    ASSERT_TRUE(file.wires.contains(name)) << name;
    ASSERT_EQ(file.wires.at(name).size(), 1u);
    EXPECT_EQ(file.wires.at(name)[0].time, 0);
    EXPECT_FALSE(file.wires.at(name)[0].level);
  }
  EXPECT_EQ(file.stamps.back(), 1'000'000);
}

TEST_F(Vcd, EdgesOfSeveralMcusAreMergedByTime) {
  auto writer = *VcdWriter::create(path, std::array<std::uint8_t, 2>{1, 2});
  writer->edge({100, 0, Signal::kDir, 3, true});
  writer->edge({300, 0, Signal::kStep, 3, true});
  writer->edge({350, 0, Signal::kStep, 3, false});
  writer->edge({200, 1, Signal::kEnable, 0, true});
  writer->edge({300, 1, Signal::kStep, 15, true});
  writer->settled(300);
  writer->edge({300, 1, Signal::kStep, 14, true});
  writer->settled(1000);
  EXPECT_EQ(writer->edges_written(), 6u);
  ASSERT_TRUE(writer->close(1000));
  const VcdFile file = read_vcd(path);
  EXPECT_EQ(file.stamps, (std::vector<std::int64_t>{0, 100, 200, 300, 350, 1000}));
  EXPECT_EQ(file.wires.at("mcu1.step3").at(1).time, 300);
  EXPECT_EQ(file.wires.at("mcu1.step3").at(2).time, 350);
  EXPECT_EQ(file.wires.at("mcu2.step14").at(1).time, 300);
  EXPECT_EQ(file.wires.at("mcu2.en").at(1).time, 200);
}

TEST_F(Vcd, CurrentsAreRealVariablesOfTheMcuThatHasThem) {
  auto writer = *VcdWriter::create(path, std::array<std::uint8_t, 2>{1, 2}, {2});
  writer->edge({100, 1, Signal::kStep, 3, true});
  writer->sample({100, 1, 3, 0.25});
  writer->sample({250, 0, 3, 1.0});  // nobody measures there
  writer->sample({200, 1, 0, 1.50004});
  writer->settled(1000);
  ASSERT_TRUE(writer->close(1000));
  const VcdFile file = read_vcd(path);
  using Values = std::vector<std::pair<std::int64_t, double>>;
  EXPECT_EQ(file.reals.size(), 4u);
  EXPECT_EQ(file.reals.at("mcu2.current3_a"), (Values{{0, 0.0}, {100, 0.25}}));
  EXPECT_EQ(file.reals.at("mcu2.current0_a"), (Values{{0, 0.0}, {200, 1.5}}));
  EXPECT_EQ(file.stamps, (std::vector<std::int64_t>{0, 100, 200, 1000}));
}

TEST_F(Vcd, InputsAndTheSupplyAreThereToo) {
  auto writer = *VcdWriter::create(path, std::array<std::uint8_t, 2>{1, 2}, {}, "", {2});
  writer->edge({100, 0, Signal::kTrigger, 0, true});
  writer->edge({100, 1, Signal::kEmergency, 0, true});
  writer->sample({150, 1, Sample::kSupply, 1023});
  writer->settled(200);
  writer->sample({180, 1, Sample::kSupply, 512});  // of a tick that has been written
  writer->edge({200, 0, Signal::kTrigger, 0, false});
  ASSERT_TRUE(writer->close(1000));
  const VcdFile file = read_vcd(path);
  ASSERT_EQ(file.wires.at("mcu1.trigger").size(), 3u);
  EXPECT_EQ(file.wires.at("mcu1.trigger").at(1).time, 100);
  EXPECT_EQ(file.wires.at("mcu1.trigger").at(2).time, 200);
  EXPECT_EQ(file.wires.at("mcu1.position_compare").size(), 1u);
  EXPECT_EQ(file.wires.at("mcu2.emergency").at(1).time, 100);
  EXPECT_EQ(file.wires.at("mcu1.emergency").size(), 1u);
  using Values = std::vector<std::pair<std::int64_t, double>>;
  EXPECT_EQ(file.reals.size(), 1u);
  EXPECT_EQ(file.reals.at("mcu2.supply"), (Values{{0, 0.0}, {150, 1023}, {180, 512}}));
}

TEST_F(Vcd, FileHoldsWhatTheBusDid) {
  auto writer = *VcdWriter::create(path, std::array<std::uint8_t, 2>{1, 2});
  Bus bus(500'000, writer.get());
  bus.add_mcu({.address = 1, .clock_ppm = 30});
  bus.add_mcu({.address = 2, .boot_ns = 999'999, .clock_ppm = -30});
  FrameMaster master(bus);
  master.bring_up(1'000'000, BUSHD_FORMAT_FINE);
  for (const std::uint8_t address : {std::uint8_t{1}, std::uint8_t{2}}) {
    master.upload_table(address, 0, 1000, {4000, 2000, 1500, 1000}, 1000);
    master.assign(address, 7, 0);
    master.fine_ticks(address, 7, bus.mcu(0).core().tick + 20,
                      std::vector<std::int16_t>(50, address == 1 ? 256 : -256), 1000);
  }
  bus.advance_to(bus.now_ns() + 150'000'000);
  ASSERT_TRUE(writer->close(bus.now_ns()));
  const VcdFile file = read_vcd(path);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& steps = file.wires.at("mcu" + std::to_string(i + 1) + ".step7");
    const bushd_virtual_shaft& shaft = bus.mcu(i).shaft(7);
    EXPECT_EQ((steps.size() - 1) / 2, shaft.travel_steps);
    EXPECT_EQ(shaft.position_steps, i == 0 ? 54 : -54);
    for (std::size_t k = 0; k < steps.size(); ++k) EXPECT_EQ(steps[k].level, k % 2 == 1);
  }
  EXPECT_EQ(file.wires.at("mcu1.dir7").size(), 2u);
  EXPECT_EQ(file.wires.at("mcu2.dir7").size(), 1u) << "negative is low, and so from the beginning";
  EXPECT_EQ(file.wires.at("mcu1.en").size(), 2u);
}

TEST_F(Vcd, FileThatCannotBeCreatedIsNamed) {
  const auto writer = VcdWriter::create("/nowhere/x.vcd", std::array<std::uint8_t, 1>{1});
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().file, "/nowhere/x.vcd");
  EXPECT_NE(writer.error().message.find("No such file"), std::string::npos);
}

TEST(VcdOnFullDisk, FailureIsReported) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const auto writer = VcdWriter::create("/dev/full", std::array<std::uint8_t, 1>{1});
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message.find("No space left"), std::string::npos);
}

}  // namespace
}  // namespace bushd::sim::vcd_test
