// Any text as the file of an envelope: a run by the table as it is told, or an error that names the
// file.
#include <string_view>

#include "fuzz/fuzz.h"
#include "fuzz/fuzz_table.h"
#include "motion/zone_run.h"

namespace bushd::fuzz {
namespace {

void run(std::string_view text) {
  constexpr double kMostStepsTried = 20'000;  // a run has all its delays in memory
  const auto zones = tables::parse_zones(text, "fuzz.envelope");
  if (!zones) {
    BUSHD_REQUIRE(zones.error().file == "fuzz.envelope" && !zones.error().message.empty());
    return;
  }
  const auto again = tables::parse_zones(tables::to_text(*zones), "again.envelope");
  BUSHD_REQUIRE(again && *again == *zones);
  const double way = zones->steps_of(zones->end - zones->zones.front().from);
  if (way > kMostStepsTried || way < -kMostStepsTried) return;
  const auto run = motion::zone_run(*zones, fuzz_table());
  if (!run) {
    BUSHD_REQUIRE(!run.error().message.empty());
    return;
  }
  std::uint32_t steps = 0;
  std::uint64_t end_ns = 0;
  for (const motion::ZoneRun::Part& part : run->parts) {
    steps += part.steps;
    BUSHD_REQUIRE(part.end_ns >= end_ns);
    end_ns = part.end_ns;
  }
  BUSHD_REQUIRE(run->steps() == steps && steps > 0);
  const auto codes = motion::written_codes(*run, "fuzz");
  if (!codes) return;
  const std::size_t falling = codes->decel ? codes->decel->size() : 0;
  BUSHD_REQUIRE(codes->accel.size() + falling <= steps);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({reinterpret_cast<const char*>(data), size});
  return 0;
}
