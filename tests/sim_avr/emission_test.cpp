// Emission on the image that only its own pins and its converter can show; tests/conformance has
// the rest.
#include <cmath>

#include "sim/supply_current.h"
#include "sim_avr/avr_fixture.h"

namespace bushd::sim {
namespace {

constexpr std::uint32_t kLongTickNs = 16'384'000;  // 128 slots of 128 us

// What the drivers take follows the pins.
class Supply final : public EdgeSink {
 public:
  void edge(const Edge& edge) override {
    current.edge(edge);
    recorder.edge(edge);
  }
  void settled(TimeNs until_ns) override { recorder.settled(until_ns); }

  SupplyCurrent current{SupplyRules{}};
  Recorder recorder;
};

TEST(AvrEmission, SupplyCurrentIsMeasuredAndPulsesAreAsFarApart) {
  Supply supply;
  Bus bus(500'000, &supply);
  AvrMcu* avr = nullptr;
  bus.add_mcu([&](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
    AvrOptions options;
    options.image = AVR_IMAGES "-500000.elf";
    options.address = 2;
    auto mcu = std::make_unique<AvrMcu>(options, index, driver, sink);
    avr = mcu.get();
    avr->on_conversion = [&](TimeNs now_ns) { return supply.current.reading(now_ns); };
    return mcu;
  });
  Master master(bus);
  master.patience_ns = 6'000'000;
  bus.advance_to(250'000'000);
  ASSERT_NO_FATAL_FAILURE(master.bring_up(kLongTickNs, BUSHD_FORMAT_COARSE));
  ASSERT_NO_FATAL_FAILURE(master.upload_table(2, 0, 10'000, {4000, 3000}, 2500));
  bushd_emission settings{};
  settings.mode = BUSHD_EMISSION_STAGGERED;
  settings.step_us = 2048;
  ASSERT_EQ(master.acknowledged(2, BUSHD_MSG_EMISSION, bushd_encode_emission, settings), BUSHD_OK);
  for (std::uint8_t m = 0; m < 2; ++m) ASSERT_NO_FATAL_FAILURE(master.assign(2, m, 0));
  EXPECT_EQ(master.poll(2).state, BUSHD_STATE_BUSY);
  bus.advance_to(bus.now_ns() + 40 * TimeNs{kLongTickNs});
  const bushd_report report = master.poll(2);
  EXPECT_EQ(report.state, BUSHD_STATE_READY);
  EXPECT_EQ(report.motor[0].position_steps, 0);
  EXPECT_EQ(supply.recorder.times(0, Signal::kStep, 0, true).size(), 2u)
      << "a step and its way back";

  // One step of both motors, a tick after another.
  supply.recorder.edges.clear();
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  const std::array<std::uint16_t, 2> delays{};
  std::size_t size = bushd_encode_ticks_head(0, BUSHD_TICKS_START, report.tick + 20, 1, 3,
                                             delays.data(), payload.data());
  payload[size++] = 0x81;
  payload[size++] = 0x81;
  payload.resize(size);
  master.send(2, BUSHD_MSG_TICKS, payload);
  bus.advance_to(bus.now_ns() + 30 * TimeNs{kLongTickNs});
  const auto first = supply.recorder.times(0, Signal::kStep, 0, true);
  const auto second = supply.recorder.times(0, Signal::kStep, 1, true);
  ASSERT_EQ(first.size(), 1u);
  ASSERT_EQ(second.size(), 1u);
  // dt_p is 518 us. A fifth of it earlier the current is within 1/16 of its peak and two counts of
  // the converter; a conversion of 104 us later it is seen, and the next slot of 128 us is used.
  EXPECT_GE(second[0] - first[0], 518'000 * 4 / 5);
  EXPECT_LE(second[0] - first[0], 518'000 + 104'000 + 128'000);
}

}  // namespace
}  // namespace bushd::sim
