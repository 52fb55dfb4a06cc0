#include "daemon/shell/state_folder.h"

#include <chrono>
#include <cstdlib>
#include <random>
#include <system_error>
#include <utility>
#include <vector>

namespace bushd::daemon {
namespace {

constexpr const char* kDefaultFolder = "/var/lib/bushd";

}  // namespace

StateFolder state_folder(const config::State& config) {
  if (config.path && config.path->empty()) {
    return {.wanted = false, .why_not = "[state] path is \"\""};
  }
  if (config.path) return {.path = *config.path};
  // With several folders, systemd puts colons between them.
  if (const char* given = std::getenv("STATE_DIRECTORY"); given != nullptr && *given != '\0') {
    const std::string folders = given;
    return {.path = folders.substr(0, folders.find(':'))};
  }
  std::error_code error;
  if (std::filesystem::is_directory(kDefaultFolder, error)) {
    return {.path = kDefaultFolder, .configured = false};
  }
  return {.wanted = false,
          .why_not = std::string("there is no folder ") + kDefaultFolder +
                     "; make it, or set [state] path"};
}

Result<state::Store> open_store(const config::Config& config, const std::filesystem::path& folder) {
  std::vector<std::string> motors;
  for (const config::Motor& motor : config.motors) motors.push_back(motor.name);
  std::random_device random;
  const auto utime_us = std::chrono::duration_cast<std::chrono::microseconds>(
                            std::chrono::system_clock::now().time_since_epoch())
                            .count();
  return state::Store::open(state::real_disk(),
                            {.folder = folder,
                             .motors = std::move(motors),
                             .unguarded = !config.state.required,
                             .utime_us = utime_us,
                             .random = std::uint64_t{random()} << 32 | random()});
}

}  // namespace bushd::daemon
