// The subcommand about what may be changed of motors in operation.
#include <fmt/format.h>

#include <memory>
#include <variant>

#include "base/printable.h"
#include "commands.h"
#include "config/setting.h"
#include "settings.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;
using bushd::client::detail_of;

struct ConfigOptions {
  std::vector<std::string> words;
  bool diff = false;
  bool save = false;
  bool json = false;
};

// The result, or the exit code where there is none.
struct Configured {
  api::Configuration configuration;
  std::string reason;
};
tl::expected<Configured, int> configure(Client& client, const api::Configure& request) {
  const auto reply = client.run(request, Client::Until::kResult);
  if (!reply) return tl::unexpected(failure(client, reply.error()));
  const auto* completed = std::get_if<api::Completed>(&*reply);
  const auto* configuration = detail_of<api::Configuration>(*reply);
  if (configuration == nullptr || completed->outcome != api::Outcome::kDone) {
    return tl::unexpected(refused(*reply));
  }
  return Configured{*configuration, completed->reason};
}

int nothing_differs(const api::Configuration& configuration) {
  fmt::print("nothing differs from {}\n", bushd::printable(configuration.path));
  return kDone;
}

int show(const api::Configuration& configuration, const ConfigOptions& options) {
  if (!options.json && configuration.settings.empty()) return nothing_differs(configuration);
  print_lines(options.json ? std::vector{json(configuration)} : table(configuration));
  return kDone;
}

int save_and_tell(Client& client, const api::Configuration& configuration) {
  if (configuration.settings.empty()) return nothing_differs(configuration);
  const auto saved = save(configuration);
  if (!saved) {
    fmt::print(stderr, "bushctl: not saved: {}\n", bushd::printable(saved.error().text()));
    return kFailed;
  }
  for (const auto& [motor, key, value] : saved->changes) {
    fmt::print("{}: {} = {}\n", bushd::printable(motor), bushd::printable(key),
               bushd::printable(value));
  }
  fmt::print("written to {}\n", bushd::printable(configuration.path));
  const auto told = configure(client, *saved);
  if (told) return kDone;
  fmt::print(stderr,
             "bushctl: bushd does not know yet that it is written; restart bushd before "
             "changing these again\n");
  return told.error();
}

int run(Client& client, const api::Configure& request, const ConfigOptions& options) {
  auto answer = configure(client, request);
  if (!answer) return answer.error();
  auto& [configuration, reason] = *answer;
  if (options.save) return save_and_tell(client, differences(std::move(configuration)));
  if (request.kind == api::Configure::Kind::kChange && !options.json) {
    fmt::print("{}\n", bushd::printable(reason));
    return kDone;
  }
  return show(options.diff ? differences(std::move(configuration)) : configuration, options);
}

std::string keys_help() {
  std::string lines;
  for (const auto key : bushd::config::kSettingKeys) {
    lines += fmt::format("{:37}{}\n", "", help_of(key));
  }
  return lines;
}

}  // namespace

void add_config_commands(CommandLine& commands) {
  const auto options = std::make_shared<ConfigOptions>();
  commands.add("config", "Change settings of motors in operation")
      .footer(
          "bushctl config [NAME]                what they are, and what bushd.toml says\n"
          "bushctl config NAME KEY=VALUE...     changes them, at rest:\n" +
          keys_help() +
          "bushctl config --diff                what differs from bushd.toml\n"
          "bushctl config --save                writes that into bushd.toml, on the PC of bushd\n"
          "What is changed is kept in the state store, and counts until its key in bushd.toml is "
          "edited.")
      .words("NAME", &options->words, "Motor (default: all), then changes KEY=VALUE",
             Command::Needed::kNo)
      .flag("--diff", &options->diff, "Show only what differs from bushd.toml")
      .flag("--save", &options->save, "Write what differs into bushd.toml")
      .flag("--json", &options->json, "Print JSON")
      .run([&commands, options] {
        const auto request = parse_settings(options->words);
        if (!request) return wrong_usage(request.error());
        return with_client(commands.connection(),
                           [&](Client& client) { return run(client, *request, *options); });
      });
}

}  // namespace bushctl
