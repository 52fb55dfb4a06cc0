// bushd: the program. Exit codes: 0 ended on request or the configuration is good, 1 it could not
// start or go on, 2 wrong usage.
#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <optional>
#include <string>

#include "base/standard_output.h"
#include "daemon/event_loop.h"

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
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

int run(const bushd::config::Config& config, const std::string& move_log_path,
        const std::string& in_service_path) {
  block_signals();
  std::optional<bushd::daemon::MoveLog> move_log;
  if (!move_log_path.empty()) {
    auto opened = bushd::daemon::MoveLog::open(move_log_path);
    if (!opened) {
      spdlog::error("{}", opened.error().text());
      return 1;
    }
    move_log.emplace(std::move(*opened));
  }
  auto transport = bushd::lcm::Transport::open(config.lcm.url);
  if (!transport) {
    spdlog::error("{}", transport.error().text());
    return 1;
  }
  spdlog::info("bushd: {}, LCM {}", extent(config), config.lcm.url);
  bushd::daemon::EventLoop loop(config, **transport, move_log ? &*move_log : nullptr,
                                bushd::daemon::TableLibrary(config, in_service_path));
  if (const auto ended = loop.run(); !ended) {
    spdlog::error("{}", ended.error().text());
    return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"bushd moves stepper motors from acceleration tables"};
  app.footer(
      "Exit codes: 0 ended on request or the configuration is good, 1 it could not start or go on "
      "(reason on stderr), 2 wrong usage.");
  app.set_version_flag("--version", BUSHD_VERSION);
  std::string config_path;
  std::string check_path;
  std::string move_log_path;
  std::string in_service_path;
  auto* config_option =
      app.add_option("--config", config_path, "configuration file")->type_name("FILE");
  auto* check_option = app.add_option("--check-config", check_path,
                                      "say whether this configuration is good, and end")
                           ->type_name("FILE");
  app.add_option("--move-log", move_log_path,
                 "append moves and their results to this file, as JSON lines")
      ->type_name("FILE");
  app.add_option("--in-service", in_service_path,
                 "keep here which tables groups were given (default: for a configuration in "
                 "/etc/bushd /var/lib/bushd/tables-in-service.json, else "
                 ".tables-in-service.json beside it)")
      ->type_name("FILE");
  config_option->excludes(check_option);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return bushd::finished_output(app.exit(error) == 0 ? 0 : kUsage);
  }

  spdlog::set_default_logger(spdlog::stderr_color_mt("bushd"));
  spdlog::set_pattern("%Y-%m-%d %H:%M:%S.%e %l %v");
  const bool check = !check_path.empty();
  if (!check && config_path.empty()) {
    fmt::print(stderr, "bushd: --config FILE or --check-config FILE is needed; see --help\n");
    return kUsage;
  }
  const auto config = bushd::config::load(check ? check_path : config_path);
  if (!config) {
    fmt::print(stderr, "{}\n", config.error().text());
    return 1;
  }
  if (check) {
    fmt::print("{}: good: {}\n", check_path, extent(*config));
    return bushd::finished_output(0);
  }
  return run(*config, move_log_path, in_service_path);
}
