// Reports as a master has them, one after the other; each must leave it with what the MCU tells one
// that knows nothing.
#include "engine/told.h"
#include "firmware/rig.h"

namespace bushd::test {

std::optional<bushd_report> Rig::ask_report(std::uint8_t known, std::uint8_t room,
                                            const bushd_report& before) {
  frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, {1, mcu_.config.address, 0, 0, known, room});
  const auto got = answer();
  if (!got) return std::nullopt;
  EXPECT_EQ(got->type, BUSHD_MSG_POLL);
  EXPECT_LE(got->payload.size(), std::max<std::size_t>(room, 22));
  bushd_report report = before;
  EXPECT_EQ(bushd_decode_report(got->payload.data(), got->payload.size(), &report), BUSHD_OK);
  return report;
}

bushd_report Rig::all_of_report() {
  const bushd_mcu present = mcu_;
  const auto sequence = sequence_;
  const auto report = ask_report(0, 255, {});
  mcu_ = present;
  sequence_ = sequence;
  EXPECT_TRUE(report);
  if (!report) return {};
  EXPECT_TRUE(bushd_report_is_whole(&*report));
  return *report;
}

bushd_report Rig::poll() {
  const auto report = ask_report(report_.number, 255, report_);
  EXPECT_TRUE(report);
  if (!report) return {};
  report_ = *report;
  bushd_report all = all_of_report();
  // Pins that are asked anew may be others.
  if (sense) all.inputs = report_.inputs;
  if (sense) all.system_inputs = report_.system_inputs;
  EXPECT_EQ(told(report_), told(all));
  return report_;
}

}  // namespace bushd::test
