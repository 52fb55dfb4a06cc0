#include "daemon/shell/channel_claim.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include "control/path.h"
#include "lcm/codec.h"
#include "lcm/transport.h"

namespace bushd::daemon {
namespace {

using Clock = std::chrono::steady_clock;

// States come at least every 500 ms.
constexpr std::chrono::milliseconds kListen{750};

std::string channels_text(const config::Lcm& lcm) {
  return fmt::format("channels {}_... of {}", lcm.prefix, lcm.url);
}

constexpr const char* kRemedy = "end it, or give this one another prefix in [lcm]";

// Multicast reaches the network namespace of a process, and no other; what comes after '?' in a URL
// does not choose the network.
std::string lock_name(const config::Lcm& lcm) {
  struct stat network{};
  if (::stat("/proc/self/ns/net", &network) != 0) network.st_ino = 0;
  const std::string where =
      fmt::format("{} {}", lcm.url.substr(0, lcm.url.find('?')), network.st_ino);
  return fmt::format("lcm-{}-{:016x}.lock", lcm.prefix, std::hash<std::string>{}(where));
}

Result<std::optional<control::PidLock>> lock(const config::Lcm& lcm,
                                             const std::vector<std::string>& folders) {
  for (const std::string& folder : folders) {
    std::error_code ignored;  // if it fails, so does what follows
    std::filesystem::create_directory(folder, ignored);
    auto taken = control::PidLock::take(folder + "/" + lock_name(lcm));
    if (taken.lock) return std::move(taken.lock);
    if (!taken.holder.empty()) {
      return fail(fmt::format("another bushd, {}, serves {}: {}", taken.holder, channels_text(lcm),
                              kRemedy));
    }
  }
  return std::nullopt;
}

Result<void> listen(const config::Lcm& lcm) {
  auto transport = lcm::Transport::open(lcm.url, {lcm.prefix + "_STATE"});
  if (!transport) return {};  // no network, nobody on it; who needs one will say so
  std::optional<std::string> bus;
  const auto heard = [&bus](lcm::Payload payload) {
    // Anybody may send anything.
    const auto message = lcm::decode_daemon_message("STATE", payload);
    if (message) bus = std::get<lcm::StateMessage>(*message).snapshot.bus;
  };
  const auto listening = (*transport)->subscribe(lcm.prefix + "_STATE", heard);
  if (!listening) return listening;
  const Clock::time_point until = Clock::now() + kListen;
  while (!bus && Clock::now() < until) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
    pollfd polled{.fd = (*transport)->fd(), .events = POLLIN, .revents = 0};
    ::poll(&polled, 1, static_cast<int>(left.count()));
    (*transport)->handle();
  }
  if (!bus) return {};
  return fail(fmt::format("another bushd, with a bus \"{}\", sends its state on {}: {}", *bus,
                          channels_text(lcm), kRemedy));
}

}  // namespace

std::vector<std::string> lock_folders() {
  std::vector<std::string> folders;
  const char* runtime = std::getenv("RUNTIME_DIRECTORY");
  if (runtime != nullptr && *runtime == '/') {
    const std::string given = runtime;
    folders.push_back(given.substr(0, given.find(':')));
  }
  for (const std::string& path : control::default_paths()) {
    folders.push_back(std::filesystem::path(path).parent_path());
  }
  return folders;
}

Result<ChannelClaim> ChannelClaim::make(const config::Lcm& lcm,
                                        const std::vector<std::string>& folders) {
  if (!lcm.url.starts_with("udpm://")) return ChannelClaim(std::nullopt);
  auto locked = lock(lcm, folders);
  if (!locked) return fail(locked.error());
  if (const auto alone = listen(lcm); !alone) return fail(alone.error());
  return ChannelClaim(std::move(*locked));
}

}  // namespace bushd::daemon
