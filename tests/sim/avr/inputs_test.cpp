// Each pin of the ATmega2560's inputs is the one that docs/firmware.md says.
#include "sim/avr/avr_fixture.h"

namespace bushd::sim::inputs_test {
namespace {

class AvrInputs : public AvrAlone {};

TEST_F(AvrInputs, OpenSwitchesAreInactive) {
  const bushd_report report = master_.poll(kAddress);
  EXPECT_EQ(report.inputs, 0);
  EXPECT_EQ(report.system_inputs, 0);
}

TEST_F(AvrInputs, EveryMotorHasItsOwn) {
  for (int motor = 0; motor < int{BUSHD_MOTORS_PER_MCU}; ++motor) {
    avr_->set_inputs({static_cast<std::uint16_t>(1 << motor), 0});
    pass(3 * TimeNs{kTickNs});
    const bushd_report report = master_.poll(kAddress);
    EXPECT_EQ(report.inputs, 1 << motor);
    EXPECT_EQ(report.system_inputs, 0);
  }
}

TEST_F(AvrInputs, ThoseOfTheSystemAreToldApart) {
  for (const std::uint8_t input :
       {BUSHD_INPUT_EMERGENCY, BUSHD_INPUT_FORWARD, BUSHD_INPUT_REVERSE, BUSHD_INPUT_TRIGGER}) {
    avr_->set_inputs({0, input});
    pass(3 * TimeNs{kTickNs});
    const bushd_report report = master_.poll(kAddress);
    EXPECT_EQ(report.inputs, 0);
    EXPECT_EQ(report.system_inputs, input);
  }
}

TEST_F(AvrInputs, TheCurrentIsThatOfTheLastConversion) {
  for (const std::uint16_t reading :
       {std::uint16_t{0}, std::uint16_t{1}, std::uint16_t{511}, std::uint16_t{BUSHD_MAX_CURRENT}}) {
    avr_->set_current(reading);
    pass(1'000'000);
    EXPECT_EQ(master_.poll(kAddress).current, reading);
  }
}

}  // namespace
}  // namespace bushd::sim::inputs_test
