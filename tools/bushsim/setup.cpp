#include "setup.h"

#include <fmt/format.h>

#include "config/config.h"

namespace bushsim {

using bushd::fail;
using bushd::Result;

Result<Setup> load_setup(const std::string& config_path, const std::string& bus) {
  const auto config = bushd::config::load(config_path);
  if (!config) return fail(config.error());
  std::vector<std::string> names;
  for (const auto& candidate : config->buses) names.push_back(candidate.name);
  const std::string choice = fmt::format("choose with --bus: {}", fmt::join(names, ", "));
  if (bus.empty() && names.size() > 1) {
    return fail({.message = "has several buses; " + choice, .file = config_path});
  }
  for (std::size_t i = 0; i < config->buses.size(); ++i) {
    const auto& candidate = config->buses[i];
    if (!bus.empty() && candidate.name != bus) continue;
    Setup setup{candidate.name, candidate.baud, {}};
    for (const auto& mcu : config->mcus) {
      if (mcu.bus.value == i) setup.addresses.push_back(mcu.address.value);
    }
    return setup;
  }
  return fail({.message = fmt::format("has no bus \"{}\"; {}", bus, choice), .file = config_path});
}

}  // namespace bushsim
