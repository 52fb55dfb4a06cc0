// How many table runs the image for ATmega2560 makes at once without a late tick.
#include "sim_avr/avr_fixture.h"

namespace bushd::sim {
namespace {

class AvrTableRuns : public AvrAlone {};

// Up to 9 steps a tick of 2.56 ms, by ramps of 238 codes. A poll meanwhile could cost a tick.
TEST_F(AvrTableRuns, FourOfOneFrameAreNeverLate) {
  constexpr std::uint32_t kSteps = 3000;
  constexpr std::uint8_t kMotors = 4;
  pass(kBootNs);
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_COARSE));
  std::vector<std::uint16_t> codes;
  for (int i = 0; i < 238; ++i) codes.push_back(static_cast<std::uint16_t>(1000 - 3 * i));
  ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 1'000, codes, 280));
  std::vector<bushd_table_run_entry> entries;
  for (std::uint8_t m = 0; m < kMotors; ++m) {
    ASSERT_NO_FATAL_FAILURE(master_.assign(kAddress, m, 0));
    entries.push_back({m, 0, static_cast<std::int8_t>(m % 2 == 0 ? 1 : -1), kSteps});
  }
  const bushd_report before = master_.poll(kAddress);
  const TimeNs before_ns = bus_.now_ns();
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(
      bushd_encode_table_run(0, before.tick + 24, entries.data(), kMotors, payload.data()));
  master_.send(kAddress, BUSHD_MSG_TABLE_RUN, payload);
  pass(500 * TimeNs{kTickNs});
  const bushd_report after = master_.poll(kAddress);
  const double passed = static_cast<double>(bus_.now_ns() - before_ns) / kTickNs;
  EXPECT_NEAR(after.tick - before.tick, passed, 1.0);
  EXPECT_EQ(after.moving, 0);
  EXPECT_EQ(after.faults, 0);
  for (std::uint8_t m = 0; m < kMotors; ++m) {
    const int steps = static_cast<int>(kSteps);
    EXPECT_EQ(after.motor[m].position_steps, m % 2 == 0 ? steps : -steps);
    EXPECT_EQ(steps_made(m), kSteps);
  }
}

}  // namespace
}  // namespace bushd::sim
