// Any text as bushd.toml: a configuration that keeps what config/config.h promises, or an error
// that names a file. The tables `slow` and `fast` lie beside it.
#include <cstdlib>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "bus/bus_budget.h"
#include "config/config.h"
#include "engine/run.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {
namespace {

void check_references(const config::Config& config) {
  BUSHD_REQUIRE(!config.buses.empty());
  std::set<std::pair<std::size_t, int>> addresses;
  for (const config::Mcu& mcu : config.mcus) {
    BUSHD_REQUIRE(mcu.bus.value < config.buses.size() && mcu.address.value != 0);
    BUSHD_REQUIRE(addresses.emplace(mcu.bus.value, mcu.address.value).second);
  }
  for (const config::Group& group : config.groups) BUSHD_REQUIRE(group.table != nullptr);
  std::set<std::pair<std::size_t, int>> outputs;
  for (const config::Motor& motor : config.motors) {
    BUSHD_REQUIRE(!motor.name.empty() && motor.output.value < BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE(motor.mcu.value < config.mcus.size());
    BUSHD_REQUIRE(motor.group.value < config.groups.size());
    BUSHD_REQUIRE(outputs.emplace(motor.mcu.value, motor.output.value).second);
  }
}

void check_speeds(const config::Config& config) {
  std::vector<std::uint8_t> motors_of_mcu(config.mcus.size());
  for (const config::Motor& motor : config.motors) {
    const std::uint32_t tick_ns = config.bus_of(motor).tick_ns();
    BUSHD_REQUIRE(bushd_table_max_steps_per_tick(&config.table_of(motor).view(), tick_ns) <=
                  BUSHD_MAX_STEPS_PER_TICK);
    ++motors_of_mcu[motor.mcu.value];
  }
  for (std::size_t b = 0; b < config.buses.size(); ++b) {
    const config::Bus& bus = config.buses[b];
    BUSHD_REQUIRE(bus.tick_ns() >= BUSHD_MIN_TICK_NS && bus.tick_ns() <= BUSHD_MAX_TICK_NS);
    std::vector<std::uint8_t> motors;
    for (std::size_t m = 0; m < config.mcus.size(); ++m) {
      if (config.mcus[m].bus.value == b) motors.push_back(motors_of_mcu[m]);
    }
    BUSHD_REQUIRE(fieldbus::bus_load(bus.baud, bus.tick_ns(), bus.format, motors) <=
                  fieldbus::kMaxBusLoad);
  }
}

void run(std::string_view text) {
  const auto config = config::parse(text, BUSHD_SOURCE_DIR "/tests/fuzz/bushd.toml");
  if (!config) {
    BUSHD_REQUIRE(!config.error().file.empty() && config.error().line >= 0);
    BUSHD_REQUIRE(!config.error().message.empty());
    return;
  }
  check_references(*config);
  check_speeds(*config);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({reinterpret_cast<const char*>(data), size});
  return 0;
}
