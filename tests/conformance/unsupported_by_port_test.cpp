// What an MCU may support and a port does not, with the reason, and that the port denies it. The
// list is compared with the capabilities in docs/protocol.md, so it is complete.
#include <cstdio>
#include <fstream>
#include <map>
#include <regex>
#include <string>

#include "conformance/pulse_bench.h"
#include "source_path.h"

namespace bushd::test {
namespace {

struct Unsupported {
  const char* name;          // the protocol's, as far as names of tests can have it
  std::uint32_t capability;  // of docs/protocol.md; 0: `says_no` tells
  const char* why;
  bool (*says_no)(PulseBench& bench) = nullptr;
};
const std::vector<Unsupported> kUnsupported = {
    {"TICKS", 0, "no step can be put at a time: bytes leave when they leave",
     [](PulseBench& bench) { return !bench.master().offers().streams; }},
    {"several_motors", 0, "a port has one TXD; lines of several ports are tested with the daemon",
     [](PulseBench& bench) { return bench.master().view({0}).identity.motors == 1; }},
    {"CONTROL_disable_drivers", 0, "no line is left for EN",
     [](PulseBench& bench) {
       bench.master().control({0}, BUSHD_CONTROL_DISABLE);
       bench.run_for(0.1);
       return bench.count_of<link::RequestRefused>() == 1;
     }},
    {"EMERGENCY_disable", BUSHD_CAN_DISABLE, "no line is left for EN"},
    {"CONTROL_named_faults", BUSHD_CAN_CLEAR_NAMED,
     "it clears at once: nothing comes up while that is on its way"},
    {"TABLE_TICKS", BUSHD_CAN_TABLE_TICKS, "there are no slots"},
    {"LOCAL", BUSHD_CAN_LOCAL, "nothing runs without the daemon"},
    {"TRIGGER", BUSHD_CAN_TRIGGER, "an edge at a modem line is seen milliseconds later"},
    {"POSITION_COMPARE", BUSHD_CAN_POSITION_COMPARE, "no line is left for it"},
    {"EMISSION_burst", BUSHD_CAN_BURST, "there are no slots"},
    {"EMISSION_common_DIR", BUSHD_CAN_COMMON_DIR, "there is one motor"},
    {"EMISSION_staggered", BUSHD_CAN_STAGGERED, "there is one motor"},
    {"EMISSION_phases", BUSHD_CAN_PHASES, "TXD is one line"},
    {"MOTOR_INPUTS", BUSHD_CAN_MOTOR_INPUTS,
     "`inputs` of the bus names the modem lines that are switches; no request changes them"},
    {"LINE_RUN", BUSHD_CAN_LINE_RUN, "no tick is common to two ports"},
    {"LINE_RUN_elementary", BUSHD_CAN_ELEMENTARY, "there is one motor"},
    {"TRAVEL", BUSHD_CAN_TRAVEL, "nothing runs without the daemon"},
    {"PROGRAM", BUSHD_CAN_PROGRAM, "nothing runs without the daemon"},
    {"CURRENTS", BUSHD_CAN_CURRENTS, "there is no chopper"},
    {"VELOCITY", BUSHD_CAN_VELOCITY, "nothing runs without the daemon"},
    {"LOCAL_keypad", BUSHD_CAN_KEYPAD, "RXD is not connected"},
    {"OUTPUTS", BUSHD_CAN_OUTPUTS,
     "`direction_line` of the bus has the level of DIR, and TXD is what it is"},
    {"volatile_table_bank", BUSHD_CAN_SCRATCH, "no table is uploaded to a port"},
};

// Words of the protocol by capability.
std::map<std::uint32_t, std::string> capabilities_of_protocol() {
  std::map<std::uint32_t, std::string> capabilities;
  std::ifstream page(source_path("docs/protocol.md"));
  static const std::regex kRow(R"(\| (\d+) \| (.*) \|)");
  bool in_table = false;
  std::smatch row;
  for (std::string line; std::getline(page, line);) {
    if (line == "| capability | |") in_table = true;
    if (in_table && line.empty()) break;
    if (in_table && std::regex_match(line, row, kRow)) {
      capabilities[static_cast<std::uint32_t>(std::stoul(row[1]))] = row[2];
    }
  }
  return capabilities;
}

class UnsupportedByPort : public testing::TestWithParam<Unsupported> {};
INSTANTIATE_TEST_SUITE_P(Is, UnsupportedByPort, testing::ValuesIn(kUnsupported),
                         [](auto& entry) { return std::string(entry.param.name); });

TEST_P(UnsupportedByPort, IsDenied) {
  const Unsupported& entry = GetParam();
  std::printf("  a port does not support %s: %s\n", entry.name, entry.why);
  RecordProperty("unsupported", entry.name);
  RecordProperty("why", entry.why);
  for (const PortTarget& target : port_targets()) {
    SCOPED_TRACE(target.name);
    PulseBench bench(target);
    if (entry.says_no != nullptr) {
      EXPECT_TRUE(entry.says_no(bench));
    } else {
      EXPECT_EQ(bench.master().view({0}).identity.capabilities & entry.capability, 0u);
    }
  }
}

class SupportedByPort : public testing::TestWithParam<PortTarget> {};
INSTANTIATE_TEST_SUITE_P(Is, SupportedByPort, testing::ValuesIn(port_targets()),
                         [](auto& target) { return target.param.name; });

// Every capability of the protocol, but for those that are listed above; and no bit beyond them.
TEST_P(SupportedByPort, WhatIsNotListedAsUnsupported) {
  std::map<std::uint32_t, std::string> left = capabilities_of_protocol();
  ASSERT_GE(left.size(), 19u) << "the table of capabilities was not found in docs/protocol.md";
  for (const Unsupported& entry : kUnsupported) {
    if (entry.capability == 0) continue;
    EXPECT_EQ(left.erase(entry.capability), 1u)
        << entry.name << " is listed twice, or is no capability of the protocol";
  }
  PulseBench bench(GetParam());
  std::uint32_t supported = bench.master().view({0}).identity.capabilities;
  for (const auto& [bit, words] : left) {
    EXPECT_NE(supported & bit, 0u) << '"' << words << "\" is neither supported nor listed";
    supported &= ~bit;
  }
  EXPECT_EQ(supported, 0u) << "no capability of the protocol, or listed as unsupported";
}

}  // namespace
}  // namespace bushd::test
