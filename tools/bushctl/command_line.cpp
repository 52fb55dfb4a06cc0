#include "command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "base/nearest_name.h"
#include "base/parse_error.h"
#include "commands.h"

namespace bushctl {

namespace {

// Says how the words are called that a command sorts by itself.
class NamesWords : public CLI::Formatter {
 public:
  explicit NamesWords(std::string words) : words_(std::move(words)) {}
  std::string make_usage(const CLI::App* app, std::string name) const override {
    std::string usage = CLI::Formatter::make_usage(app, std::move(name));
    while (usage.ends_with('\n')) usage.pop_back();
    return usage + " " + words_ + "\n";
  }

 private:
  std::string words_;
};

}  // namespace

bushd::client::ClientOptions Connection::options() const {
  using Way = bushd::client::ClientOptions::Way;
  bushd::client::ClientOptions options{.url = url,
                                       .prefix = prefix,
                                       .program = "bushctl",
                                       .another = "--socket PATH ($BUSHD_CONTROL), or --lcm"};
  options.socket = socket;
  if (!socket.empty()) {
    options.way = Way::kSocket;
  } else if (lcm || lcm_options) {
    options.way = Way::kLcm;
  }
  return options;
}

Command& Command::footer(const std::string& text) {
  if (!text.empty()) app_->footer(text);
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

Command& Command::option_with(const std::string& with, const std::string& name, std::string* value,
                              const std::string& text) {
  app_->add_option(name, *value, text)->needs(app_->get_option(with));
  return *this;
}

Command& Command::option(const std::string& name, std::string* value, const std::string& text) {
  CLI::Option* option = app_->add_option(name, *value, text);
  if (!name.starts_with('-')) option->required();
  return *this;
}

Command& Command::word(const std::string& name, std::string* value, const std::string& text) {
  app_->add_option(name, *value, text);
  return *this;
}

Command& Command::file(const std::string& name, std::string* value, const std::string& text) {
  app_->add_option(name, *value, text)->type_name("FILE")->capture_default_str();
  return *this;
}

Command& Command::choice(const std::string& name, std::string* value,
                         const std::vector<std::string>& allowed, const std::string& text) {
  app_->add_option(name, *value, text)->check(CLI::IsMember(allowed))->capture_default_str();
  return *this;
}

Command& Command::choice_with(const std::string& with, const std::string& name, std::string* value,
                              const std::vector<std::string>& allowed, const std::string& text) {
  choice(name, value, allowed, text);
  app_->get_option(name)->needs(app_->get_option(with));
  return *this;
}

namespace {

// The check of a range lets NaN through: it is neither too small nor too large.
std::string not_a_number(const std::string& text) {
  double value = 0;
  const bool is_nan = CLI::detail::lexical_cast(text, value) && std::isnan(value);
  return is_nan ? text + " is not a number" : std::string();
}

}  // namespace

template <class Number>
Command& Command::number(const std::string& name, Number* value, Number least, Number most,
                         const std::string& text, Needed needed) {
  CLI::Option* option = app_->add_option(name, *value, text)->check(CLI::Range(least, most));
  if constexpr (std::is_floating_point_v<Number>) option->check(CLI::Validator(not_a_number, ""));
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

Command& Command::raw_words(std::vector<std::string>* value, const std::string& usage) {
  app_->allow_extras();
  auto formatter = std::make_shared<NamesWords>(usage);
  // As of all other commands.
  formatter->column_width(app_->get_formatter()->get_column_width());
  app_->formatter(std::move(formatter));
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

void Command::run_with_client(std::function<int(bushd::client::Client&)> action) {
  run([connection = connection_, action = std::move(action)] {
    return with_client(*connection, action);
  });
}

CommandLine::CommandLine(const std::string& version)
    : app_(std::make_unique<CLI::App>("bushctl: move and watch the motors of a running bushd",
                                      "bushctl")) {
  app_->footer(
      "The daemon is reached by its control socket, or by LCM if that is asked for.\n"
      "Exit codes: 0 done, 1 refused or not done (reason on stderr), 2 wrong usage.");
  app_->set_version_flag("--version", version);
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
  app->add_option("--url", connection_.url,
                  fmt::format("Use LCM with this URL; without it $LCM_DEFAULT_URL, else {}",
                              bushd::client::kDefaultUrl))
      ->check(CLI::Validator(means_lcm, ""));
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
  return {command, connection_};
}

Command CommandLine::add_local(const std::string& name, const std::string& text) {
  return {app_->add_subcommand(name, text), connection_};
}

namespace {

// What is wrong if the word that stands where a command of `app` should is none. `called`: the
// words up to there.
std::optional<std::string> no_command(const CLI::App& app, const std::string& called,
                                      std::span<const std::string> arguments) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& word = arguments[i];
    if (word.starts_with("-")) {
      const CLI::Option* option = app.get_option_no_throw(word);
      if (option != nullptr && option->get_items_expected_max() > 0) ++i;
      continue;
    }
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) {
      const bool same = command->get_name() == word;
      if (same && command->get_subcommands({}).empty()) return std::nullopt;
      if (same) return no_command(*command, called + " " + word, arguments.subspan(i + 1));
      names.push_back(command->get_name());
    }
    return fmt::format("there is no command \"{}\"{} ('{} --help' lists them)", word,
                       bushd::did_you_mean(word, names), called);
  }
  return std::nullopt;
}

// Steps may be negative, and no motor's name begins with a dash: behind "--" a command that sorts
// its words by itself finds what it would find without.
bool sorts_its_words(const CLI::App& app, std::span<const std::string> arguments) {
  return std::ranges::any_of(app.get_subcommands({}), [&](const CLI::App* command) {
    return command->get_allow_extras() &&
           std::ranges::find(arguments, command->get_name()) != arguments.end();
  });
}

// Behind the name of a motor, where a command sorts its words by itself, a position follows "--to",
// which is no option of CLI11's.
bool takes_to(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.size() < 2 || !std::string_view("--to").starts_with(words.back())) return false;
  const std::string& before = words[words.size() - 2];
  const auto is_before = [&](const CLI::App* command) { return command->get_name() == before; };
  const bool is_name = !before.starts_with('-') &&
                       std::ranges::none_of(app.get_subcommands({}), is_before) &&
                       before.find_first_not_of("0123456789.+-") != std::string::npos;
  return is_name && sorts_its_words(app, words);
}

}  // namespace

bushd::Completion CommandLine::complete(const std::vector<std::string>& words) {
  bushd::Completion completion = bushd::complete(*app_, words);
  if (takes_to(*app_, words)) {
    completion.words.emplace("--to");
    completion.value.clear();
  }
  for (const auto& [option, value] : completion.given) {
    if (option == "--socket") connection_.socket = value;
    if (option == "--url") connection_.url = value;
    if (option == "--prefix") connection_.prefix = value;
    connection_.lcm_options = connection_.lcm_options || option == "--url" || option == "--prefix";
  }
  connection_.lcm = std::ranges::find(words, "--lcm") != words.end();
  return completion;
}

int CommandLine::run(int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  if (const auto wrong = no_command(*app_, "bushctl", arguments))
    return wrong_usage({.message = *wrong});
  const auto ends = std::ranges::find(arguments, "--");
  if (ends != arguments.end() && sorts_its_words(*app_, {arguments.begin(), ends})) {
    arguments.erase(ends);
  }
  std::ranges::reverse(arguments);  // as CLI::App takes them
  try {
    app_->parse(std::move(arguments));
  } catch (const CLI::RuntimeError& ran) {
    return ran.get_exit_code();
  } catch (const CLI::ParseError& error) {
    return bushd::answered(*app_, error) ? kDone : kUsage;
  }
  return kDone;
}

}  // namespace bushctl
