// What a virtual MCU is by its options.
#include "sim/mcu_alone.h"

namespace bushd::sim::virtual_mcu_test {
namespace {

constexpr std::uint32_t kAll =
    // Those that one can be without.
    ((UINT32_C(2) * BUSHD_CAN_SCRATCH) - 1) | BUSHD_CAN_SLOW_RUNS | BUSHD_CAN_PROGRAM |
    BUSHD_CAN_ELEMENTARY;

class DisabledCapability : public McuAlone, public testing::WithParamInterface<std::uint32_t> {
 protected:
  DisabledCapability() : McuAlone(kBaud, kTickNs) {
    bus_.add_mcu({.address = kAddress, .disabled_capabilities = GetParam()});
  }

  std::uint32_t capabilities() {
    const auto identity = master_.identify(kAddress);
    EXPECT_TRUE(identity);
    return identity ? identity->capabilities : 0;
  }
};

std::vector<std::uint32_t> every_one_none_and_all() {
  std::vector<std::uint32_t> disabled{0, kAll};
  for (std::uint32_t bit = 1; bit <= BUSHD_CAN_SCRATCH; bit *= 2) disabled.push_back(bit);
  disabled.push_back(BUSHD_CAN_SLOW_RUNS);
  disabled.push_back(BUSHD_CAN_PROGRAM);
  disabled.push_back(BUSHD_CAN_ELEMENTARY);
  return disabled;
}
INSTANTIATE_TEST_SUITE_P(Of, DisabledCapability, testing::ValuesIn(every_one_none_and_all()),
                         testing::PrintToStringParamName());

TEST_P(DisabledCapability, IsTheOnlyOneThatIsNotInTheIdentity) {
  // It is one of lines.
  const bool no_lines = (GetParam() & BUSHD_CAN_LINE_RUN) != 0;
  const std::uint32_t without = GetParam() | (no_lines ? BUSHD_CAN_ELEMENTARY : 0);
  EXPECT_EQ(capabilities(),
            (kAll & ~without) | BUSHD_CAN_CLEAR_NAMED | BUSHD_CAN_OUTPUTS | BUSHD_CAN_DISABLE);
}

// The one that a port has or has not. Messages of the others are those of the core, whose tests
// send them.
TEST_P(DisabledCapability, OfATriggerInputRefusesTrigger) {
  Bytes disarm(BUSHD_FRAME_MAX_PAYLOAD);
  disarm.resize(bushd_encode_trigger(0, BUSHD_EDGE_NONE, 0, nullptr, 0, disarm.data()));
  EXPECT_EQ(master_.acknowledged(kAddress, BUSHD_MSG_TRIGGER, disarm),
            (GetParam() & BUSHD_CAN_TRIGGER) == 0 ? BUSHD_OK : BUSHD_E_UNKNOWN_MESSAGE);
}

}  // namespace
}  // namespace bushd::sim::virtual_mcu_test
