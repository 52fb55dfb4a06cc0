// bushd: the program. Exit codes: 0 ended on request or the configuration is good, 1 it could not
// start or go on, 2 wrong usage.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <string>

#include "base/completion.h"
#include "base/parse_error.h"
#include "base/printable.h"
#include "base/standard_output.h"
#include "config/host_check.h"
#include "control/path.h"
#include "daemon/example_config.h"
#include "daemon/shell/channel_claim.h"
#include "daemon/shell/event_loop.h"
#include "daemon/shell/service_manager.h"
#include "daemon/shell/state_folder.h"

namespace {

constexpr int kUsage = 2;

std::string counted(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string extent(const bushd::config::Config& config) {
  return fmt::format("{} on {} and {}", counted(config.motors.size(), "motor", "motors"),
                     counted(config.mcus.size(), "MCU", "MCUs"),
                     counted(config.buses.size(), "bus", "buses"));
}

// In all threads, those that LCM starts included: signals are taken from a descriptor.
void block_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGHUP);
  sigaddset(&set, SIGUSR1);
  sigaddset(&set, SIGUSR2);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // write() tells it
}

// The default limit of 1024 is less than the connections that the control socket may have.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 8192);
  setrlimit(RLIMIT_NOFILE, &limit);
}

// Null without one. The one that the configuration names has to be there; of the default ones the
// first that can be made is taken; with a group, one has to be made.
bushd::Result<std::unique_ptr<bushd::control::Server>> open_control(
    const bushd::config::Control& config) {
  using bushd::control::Server;
  if (config.path) {
    if (config.path->empty()) return nullptr;
    return Server::open(*config.path, config.group);
  }
  std::string why;
  for (const std::string& path : bushd::control::default_paths()) {
    auto opened = Server::open(path, config.group);
    if (opened) return opened;
    if (!why.empty()) why += "; ";
    why += opened.error().text();
  }
  // Somebody counts on it; without it perhaps nobody could command.
  if (!config.group.empty()) return bushd::fail(why);
  spdlog::warn("no control socket, clients need LCM: {}", why);
  return nullptr;
}

struct Lcm {
  std::unique_ptr<bushd::lcm::Transport> all;
  std::unique_ptr<bushd::lcm::Transport> stops;  // null: `all` takes those too
};

// Without a network the control socket alone will do. Stops come by a transport of their own, so
// that no flood of other requests is before them; what is not on a network has one place for all.
bushd::Result<Lcm> open_lcm(const bushd::config::Lcm& config, bool has_control) {
  using bushd::lcm::Transport;
  // Multicast comes back to who sends it. Another daemon is known by its descriptions.
  auto all = Transport::open(config.url, {}, {config.prefix + "_STATE", config.prefix + "_HEALTH"});
  if (!all && has_control) {
    spdlog::error("{}; only clients of the control socket are served", all.error().text());
    all = Transport::open("memq://");
    if (!all) return bushd::fail(all.error());
    return Lcm{.all = std::move(*all), .stops = nullptr};
  }
  if (!all) return bushd::fail(all.error());
  Lcm lcm{.all = std::move(*all), .stops = nullptr};
  if (!config.commands || !config.url.starts_with("udpm://")) return lcm;
  std::vector<std::string> channels;
  for (const std::string_view channel : bushd::lcm::urgent_channels()) {
    channels.push_back(config.prefix + "_" + std::string(channel));
  }
  auto stops = Transport::open(config.url, channels);
  if (!stops) return bushd::fail(stops.error());
  lcm.stops = std::move(*stops);
  return lcm;
}

// Empty without a store: the default folder is not there or cannot be used, or none is wanted.
bushd::Result<std::optional<bushd::state::Store>> open_store(const bushd::config::Config& config) {
  const auto folder = bushd::daemon::state_folder(config.state);
  if (!folder.wanted) {
    spdlog::info("positions are not kept over power cuts: {}", folder.why_not);
    return std::nullopt;
  }
  auto store = bushd::daemon::open_store(config, folder.path);
  if (store) {
    for (const std::string& note : store->notes()) spdlog::warn("{}", note);
    spdlog::info("positions are kept in {}", folder.path.string());
    return std::optional(std::move(*store));
  }
  if (folder.configured && config.state.required) return bushd::fail(store.error());
  spdlog::warn(
      "positions and holds are not kept over power cuts, and those kept before do not count: {}",
      store.error().text());
  return std::nullopt;
}

int run(const bushd::config::Config& config, const std::string& move_log_path,
        const std::string& in_service_path) {
  raise_descriptor_limit();
  // Before there is a control socket: who connects to it is to be answered at once.
  const auto claim = bushd::daemon::ChannelClaim::make(config.lcm, bushd::daemon::lock_folders());
  if (!claim) {
    spdlog::error("{}", bushd::printable(claim.error().text()));
    return 1;
  }
  std::optional<bushd::daemon::MoveLogWriter> move_log;
  if (!move_log_path.empty()) {
    auto opened = bushd::daemon::MoveLog::open(move_log_path);
    if (!opened) {
      spdlog::error("{}", bushd::printable(opened.error().text()));
      return 1;
    }
    move_log.emplace(std::move(*opened),
                     [](bushd::daemon::LogLevel level, const std::string& text) {
                       bushd::daemon::write_log(level, bushd::printable(text));
                     });
  }
  const auto control = open_control(config.control);
  if (!control) {
    spdlog::error("{}", bushd::printable(control.error().text()));
    return 1;
  }
  const auto lcm = open_lcm(config.lcm, *control != nullptr);
  if (!lcm) {
    spdlog::error("{}", bushd::printable(lcm.error().text()));
    return 1;
  }
  auto store = open_store(config);
  if (!store) {
    spdlog::error("state store: {}. Another folder: [state] path", store.error().text());
    return 1;
  }
  spdlog::info("bushd: {}, LCM {}, control socket {}", extent(config), config.lcm.url,
               *control ? (*control)->path() : "none");
  bushd::daemon::EventLoop loop(
      config, {.lcm = *lcm->all, .stops = lcm->stops.get(), .control = control->get()},
      move_log ? &*move_log : nullptr, bushd::daemon::TableLibrary(config, in_service_path),
      *store ? &**store : nullptr);
  if (const auto ended = loop.run(); !ended) {
    spdlog::error("{}", bushd::printable(ended.error().text()));
    return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"bushd: move stepper motors by acceleration tables"};
  app.footer(
      "Exit codes: 0 ended on request or the configuration is good, 1 it could not start or go on "
      "(reason on stderr), 2 wrong usage.");
  app.set_version_flag("--version", BUSHD_VERSION);
  std::string config_path;
  std::string check_path;
  std::string move_log_path;
  std::string in_service_path;
  auto* config_option =
      app.add_option("--config", config_path, "Configuration file")->type_name("FILE");
  auto* check_option =
      app.add_option("--check-config", check_path, "Check a configuration and exit")
          ->type_name("FILE");
  bool example = false;
  app.add_flag(
      "--example-config", example,
      "Print a configuration to begin with, and exit: bushd --example-config > bushd.toml");
  app.add_option("--move-log", move_log_path,
                 "Append moves and their results to this file as JSON lines")
      ->type_name("FILE");
  app.add_option("--in-service", in_service_path,
                 "File of the tables given to groups (default: for a configuration in "
                 "/etc/bushd /var/lib/bushd/tables-in-service.json, else "
                 ".tables-in-service.json beside it)")
      ->type_name("FILE");
  config_option->excludes(check_option);
  if (const auto words = bushd::completion_asked(argc, argv)) {
    bushd::print_completion(bushd::complete(app, *words));
    return bushd::finished_output(0);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return bushd::finished_output(bushd::answered(app, error) ? 0 : kUsage);
  }

  if (example) {
    fmt::print("{}", bushd::daemon::kExampleConfig);
    return bushd::finished_output(0);
  }

  const bool check = !check_path.empty();
  if (!check && config_path.empty()) {
    fmt::print(stderr, "bushd: --config FILE or --check-config FILE is needed; see --help\n");
    return kUsage;
  }
  const auto config = bushd::config::load(check ? check_path : config_path);
  if (!config) {
    fmt::print(stderr, "{}\n", bushd::printable(config.error().text()));
    return 1;
  }
  if (const auto fits = bushd::config::check_host(*config); !fits) {
    fmt::print(stderr, "{}\n", bushd::printable(fits.error().text()));
    return 1;
  }
  if (check) {
    fmt::print("{}: good: {}\n", bushd::printable(check_path), extent(*config));
    return bushd::finished_output(0);
  }
  block_signals();
  bushd::daemon::Log log;
  const int code = run(*config, move_log_path, in_service_path);
  if (!log.end()) std::_Exit(code);
  return code;
}
