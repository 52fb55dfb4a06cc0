// bushd-web: the program. Exit codes: 0 ended on request, 1 it could not start, 2 wrong usage.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/completion.h"
#include "base/parse_error.h"
#include "base/parse_number.h"
#include "base/printable.h"
#include "base/standard_output.h"
#include "control/path.h"
#include "server.h"
#include "site.h"
#include "tokens/token_file.h"

namespace {

using bushd::fail;
using bushd::Result;
using namespace bushweb;

constexpr int kFailed = 1;
constexpr int kUsage = 2;

struct Wanted {
  std::string listen = "127.0.0.1:8260";
  std::vector<std::string> daemons{};
  std::vector<std::string> remotes{};
  std::vector<std::string> hosts{};
  std::string tokens{};
  std::string page = BUSHD_WEB_PAGE;
  std::string certificate{};
  std::string key{};
  bool behind_proxy = false;
  WhoStops stops = WhoStops::kLoopback;
};

std::string environment(const char* name, const char* otherwise) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : otherwise;
}

// "ADDRESS:PORT", "[ADDRESS]:PORT".
Result<ServerOptions> server_options(const Wanted& wanted) {
  const std::size_t colon = wanted.listen.rfind(':');
  ServerOptions options{.address = wanted.listen.substr(0, colon),
                        .certificate = wanted.certificate,
                        .key = wanted.key};
  const std::string port = colon == std::string::npos ? "" : wanted.listen.substr(colon + 1);
  options.port = bushd::parse_number<int>(port).value_or(0);
  const bool good = options.port > 0 && options.port < 65536 && is_address(options.address);
  if (!good) return fail("--listen: ADDRESS:PORT is expected, such as 127.0.0.1:8260");
  std::erase_if(options.address, [](char c) { return c == '[' || c == ']'; });
  if (wanted.certificate.empty() != wanted.key.empty()) {
    return fail("--tls-cert and --tls-key belong together");
  }
  if (!is_loopback(options.address) && wanted.certificate.empty() && !wanted.behind_proxy) {
    return fail(
        "--listen: beyond this PC tokens would travel for all to read. Give --tls-cert and "
        "--tls-key, or listen at 127.0.0.1 behind a proxy that has TLS, with --behind-proxy");
  }
  return options;
}

Result<std::vector<RemoteName>> remote_names(const std::vector<std::string>& told) {
  std::vector<RemoteName> remotes;
  for (const std::string& text : told) {
    auto remote = remote_name(text);
    if (!remote) return fail(remote.error());
    remotes.push_back(std::move(*remote));
  }
  return remotes;
}

bool any_twice(const std::vector<DaemonName>& daemons, const std::vector<RemoteName>& remotes) {
  std::set<std::string> names;
  for (const DaemonName& daemon : daemons) names.insert(daemon.name);
  for (const RemoteName& remote : remotes) names.insert(remote.name);
  return names.size() < daemons.size() + remotes.size();
}

Result<std::vector<DaemonName>> daemon_names(const std::vector<std::string>& told) {
  std::vector<DaemonName> daemons;
  for (const std::string& text : told) {
    const std::size_t sign = text.find('=');
    DaemonName daemon{.name = text.substr(0, sign)};
    if (sign == std::string::npos || daemon.name.empty() || sign + 1 == text.size()) {
      return fail("--daemon: NAME=SOCKET is expected, such as hall=/run/bushd/control");
    }
    daemon.socket = text.substr(sign + 1);
    daemons.push_back(std::move(daemon));
  }
  if (!daemons.empty()) return daemons;
  // As other clients find it.
  const auto paths = bushd::control::default_paths();
  const auto there = std::ranges::find_if(paths, [](const std::string& path) {
    std::error_code error;
    return std::filesystem::exists(path, error);
  });
  const std::string usual = there == paths.end() ? paths.front() : *there;
  return std::vector{
      DaemonName{.name = "bushd", .socket = environment("BUSHD_CONTROL", usual.c_str())}};
}

// bushctl of the same installation or build.
std::string bushctl_path() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto beside = self.parent_path() / "bushctl";
  return !error && std::filesystem::exists(beside, error) ? beside.string() : "bushctl";
}

int usage(const bushd::Error& error) {
  fmt::print(stderr, "bushd-web: {}\n", bushd::printable(error.text()));
  return kUsage;
}

int serve(const Wanted& wanted) {
  const auto server_wanted = server_options(wanted);
  if (!server_wanted) return usage(server_wanted.error());
  auto daemons = daemon_names(wanted.daemons);
  if (!daemons) return usage(daemons.error());
  auto remotes = remote_names(wanted.remotes);
  if (!remotes) return usage(remotes.error());
  if (any_twice(*daemons, *remotes)) {
    return usage({.message = "--daemon and --remote: two have the same name"});
  }

  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  rlimit descriptors{};
  if (getrlimit(RLIMIT_NOFILE, &descriptors) == 0) {
    descriptors.rlim_cur = std::min<rlim_t>(descriptors.rlim_max, 4096);
    setrlimit(RLIMIT_NOFILE, &descriptors);
  }

  Poller poller;
  Server server(poller);
  if (const auto opened = server.open(*server_wanted); !opened) {
    fmt::print(stderr, "bushd-web: {}\n", bushd::printable(opened.error().text()));
    return kFailed;
  }
  Site site({.version = BUSHD_VERSION,
             .daemons = std::move(*daemons),
             .remotes = std::move(*remotes),
             .access = {.hosts = wanted.hosts,
                        .behind_proxy = wanted.behind_proxy,
                        .tls = !wanted.certificate.empty(),
                        .stops = wanted.stops},
             .tokens = wanted.tokens,
             .folder = wanted.page,
             .bushctl = bushctl_path()},
            poller, server, server);
  const Ticks ticks(Site::kTicksPerSecond);
  poller.add(ticks.fd(), [&] {
    ticks.take();
    site.tick();
    server.close_deaf();
    server.close_silent();
  });
  const int signal_fd = ::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  poller.add(signal_fd, [&] { server.end(); });
  site.tick();
  fmt::print("bushd-web: the page is at {}://{}/\n", wanted.certificate.empty() ? "http" : "https",
             bushd::printable(wanted.listen));
  std::fflush(stdout);
  return server.run(site) ? 0 : kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Shows the motors of bushd in a browser, and stops and moves them from there");
  app.set_version_flag("--version", BUSHD_VERSION);
  Wanted wanted;
  wanted.tokens = environment("BUSHD_WEB_TOKENS", bushd::tokens::kSystemFile);
  app.add_option("--listen", wanted.listen, "Where browsers find the page")
      ->type_name("ADDRESS:PORT")
      ->capture_default_str();
  app.add_option("--daemon", wanted.daemons,
                 "A daemon and its control socket; may be repeated. Without it that of this PC")
      ->type_name("NAME=SOCKET")
      ->allow_extra_args(false);
  app.add_option("--remote", wanted.remotes,
                 "A daemon as another bushd-web shows it, only to be looked at; may be repeated")
      ->type_name("NAME=URL")
      ->allow_extra_args(false);
  app.add_option("--host", wanted.hosts,
                 "A name by which browsers call this PC; may be repeated. Addresses and localhost "
                 "need none")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_option("--tokens", wanted.tokens,
                 "File of the tokens that 'bushctl web-token' makes ($BUSHD_WEB_TOKENS)")
      ->type_name("FILE")
      ->capture_default_str();
  app.add_option("--page", wanted.page, "Folder of the page")
      ->type_name("FOLDER")
      ->capture_default_str();
  app.add_option("--tls-cert", wanted.certificate, "Certificate, with its chain, in PEM")
      ->type_name("FILE");
  app.add_option("--tls-key", wanted.key, "Its private key, in PEM")->type_name("FILE");
  app.add_flag("--behind-proxy", wanted.behind_proxy,
               "Browsers come through a proxy that has TLS: who connects is not on this PC");
  const std::map<std::string, WhoStops> who{{"nobody", WhoStops::kNobody},
                                            {"loopback", WhoStops::kLoopback},
                                            {"anyone", WhoStops::kAnyone}};
  app.add_option(
         "--stop-without-token", wanted.stops,
         "Who may stop motors without a token; without this option loopback: browsers on this PC")
      ->type_name("nobody|loopback|anyone")
      ->transform(CLI::CheckedTransformer(who, CLI::ignore_case).description(""));
  app.footer("Exit codes: 0 ended on request, 1 it could not start, 2 wrong usage.");
  if (const auto words = bushd::completion_asked(argc, argv)) {
    bushd::print_completion(bushd::complete(app, *words));
    return bushd::finished_output(0);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return bushd::finished_output(bushd::answered(app, error) ? 0 : kUsage);
  }
  for (std::string& host : wanted.hosts) {
    std::ranges::transform(host, host.begin(), [](unsigned char c) { return std::tolower(c); });
  }
  return serve(wanted);
}
