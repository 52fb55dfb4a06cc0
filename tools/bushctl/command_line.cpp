#include "command_line.h"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <utility>

#include "commands.h"

namespace bushctl {

bushd::client::ClientOptions Connection::options() const {
  using Way = bushd::client::ClientOptions::Way;
  bushd::client::ClientOptions options{.url = url, .prefix = prefix, .program = "bushctl"};
  options.socket = socket;
  if (!socket.empty()) {
    options.way = Way::kSocket;
  } else if (lcm || lcm_options) {
    options.way = Way::kLcm;
  }
  return options;
}

Command& Command::footer(const std::string& text) {
  app_->footer(text);
  return *this;
}

Command& Command::flag(const std::string& name, bool* value, const std::string& text) {
  app_->add_flag(name, *value, text);
  return *this;
}

Command& Command::flag_with(const std::string& with, const std::string& name, bool* value,
                            const std::string& text) {
  app_->add_flag(name, *value, text)->needs(app_->get_option(with));
  return *this;
}

Command& Command::option(const std::string& name, std::string* value, const std::string& text) {
  CLI::Option* option = app_->add_option(name, *value, text);
  if (!name.starts_with('-')) option->required();
  return *this;
}

Command& Command::choice(const std::string& name, std::string* value,
                         const std::vector<std::string>& allowed, const std::string& text) {
  app_->add_option(name, *value, text)->check(CLI::IsMember(allowed))->capture_default_str();
  return *this;
}

template <class Number>
Command& Command::number(const std::string& name, Number* value, Number least, Number most,
                         const std::string& text, Needed needed) {
  CLI::Option* option = app_->add_option(name, *value, text)->check(CLI::Range(least, most));
  if (needed == Needed::kYes || !name.starts_with('-')) {
    option->required();
  } else if (*value != Number{}) {
    option->capture_default_str();
  }
  return *this;
}
template Command& Command::number(const std::string&, double*, double, double, const std::string&,
                                  Needed);
template Command& Command::number(const std::string&, std::int64_t*, std::int64_t, std::int64_t,
                                  const std::string&, Needed);
template Command& Command::number(const std::string&, std::uint32_t*, std::uint32_t, std::uint32_t,
                                  const std::string&, Needed);

Command& Command::words(const std::string& name, std::vector<std::string>* value,
                        const std::string& text, Needed needed) {
  CLI::Option* option = app_->add_option(name, *value, text);
  if (needed == Needed::kYes) option->required();
  return *this;
}

Command& Command::raw_words(std::vector<std::string>* value) {
  app_->allow_extras();
  raw_words_ = value;
  return *this;
}

void Command::run(std::function<int()> action) {
  // Thrown out of the parser once all is parsed: what is left is this action's exit code.
  app_->final_callback([app = app_, raw_words = raw_words_, action = std::move(action)] {
    if (raw_words != nullptr) *raw_words = app->remaining();
    throw CLI::RuntimeError(action());
  });
}

CommandLine::CommandLine()
    : app_(std::make_unique<CLI::App>("bushctl: move and watch the motors of a running bushd")) {
  const char* url = std::getenv("LCM_DEFAULT_URL");
  connection_.url = url != nullptr && *url != '\0' ? url : bushd::client::kDefaultUrl;
  app_->footer(
      "The daemon is reached by its control socket, or by LCM if there is none.\n"
      "Exit codes: 0 done, 1 refused or not done (reason on stderr), 2 wrong usage.");
  app_->require_subcommand(1);
  add_connection(app_.get());
}

CommandLine::~CommandLine() = default;

// Both before and after the subcommand.
void CommandLine::add_connection(CLI::App* app) {
  CLI::Option* socket =
      app->add_option("--socket", connection_.socket, "Use the control socket at this path")
          ->type_name("PATH");
  const auto means_lcm = [this](const std::string&) {
    connection_.lcm_options = true;
    return std::string();
  };
  app->add_flag("--lcm", connection_.lcm, "Use LCM")->excludes(socket);
  app->add_option("--url", connection_.url, "Use LCM with this URL")
      ->check(CLI::Validator(means_lcm, ""))
      ->capture_default_str();
  app->add_option("--prefix", connection_.prefix, "Use LCM with this prefix of the channels")
      ->check(CLI::Validator(means_lcm, ""))
      ->capture_default_str();
}

void CommandLine::add_group(const std::string& name, const std::string& text) {
  app_->add_subcommand(name, text)->require_subcommand(1);
}

Command CommandLine::add(const std::string& name, const std::string& text,
                         const std::string& group) {
  CLI::App* parent = group.empty() ? app_.get() : app_->get_subcommand(group);
  CLI::App* command = parent->add_subcommand(name, text);
  add_connection(command);
  return Command(command);
}

Command CommandLine::add_local(const std::string& name, const std::string& text) {
  return Command(app_->add_subcommand(name, text));
}

int CommandLine::run(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::RuntimeError& ran) {
    return ran.get_exit_code();
  } catch (const CLI::ParseError& error) {
    return app_->exit(error) == 0 ? kDone : kUsage;
  }
  return kDone;
}

}  // namespace bushctl
