#include "tools/bushctl/raw_bus_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace bushctl {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

LatencyTest tested(std::vector<std::int64_t> latencies_us) {
  const auto asked = static_cast<unsigned>(latencies_us.size());
  return {.port = "p", .baud = 500000, .asked = asked, .latencies_us = std::move(latencies_us)};
}

TEST(LatencyReport, AGoodAdapterNeedsNoAdvice) {
  const LatencyTest good = tested({300, 400, 500, 900});
  EXPECT_THAT(latency_advice(good), IsEmpty());
  const auto json = nlohmann::json::parse(latency_json(good));
  EXPECT_EQ(json["min_us"], 300);
  EXPECT_EQ(json["max_us"], 900);
  EXPECT_EQ(json["latency"][0]["answers"], 2);
  EXPECT_TRUE(json["latency"].back()["below_us"].is_null());
}

TEST(LatencyReport, AnswersHeldBackNameTheTimer) {
  EXPECT_THAT(latency_advice(tested({15000, 15500, 15900, 16100})), HasSubstr("latency_timer"));
  EXPECT_THAT(latency_advice(tested({300, 300, 5000, 9000})), HasSubstr("late"));
}

TEST(LatencyReport, LostAnswersAreTold) {
  LatencyTest test = tested({300});
  test.asked = 4;
  EXPECT_THAT(latency_advice(test), HasSubstr("3 of 4"));
}

Found mcu(std::uint8_t address, std::uint8_t id) {
  Found found{.address = address};
  found.identity.protocol_version = BUSHD_PROTOCOL_VERSION;
  found.identity.unique_id[7] = id;
  return found;
}

TEST(ScanReport, DoubledAddressesAreNamedWithTheirIds) {
  const std::vector<Found> found = {mcu(3, 0xAB), mcu(1, 1), mcu(3, 2)};
  const auto lines = scan_lines(found);
  EXPECT_THAT(lines[1], HasSubstr("0000000000000001"));
  EXPECT_THAT(lines.back(), HasSubstr("address 3 is that of 2 MCUs (0000000000000002, "
                                      "00000000000000ab)"));
  EXPECT_EQ(nlohmann::json::parse(scan_json(found))["doubled_addresses"], nlohmann::json({3}));
}

TEST(ScanReport, AnotherProtocolVersionIsTold) {
  Found old = mcu(5, 0);
  old.identity.protocol_version = 1;
  EXPECT_THAT(scan_lines({old}).back(), HasSubstr("speaks protocol version 1"));
}

}  // namespace
}  // namespace bushctl
