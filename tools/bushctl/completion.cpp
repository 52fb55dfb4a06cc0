// Names that may follow on a command line.
#include <algorithm>
#include <set>

#include "client/answer.h"
#include "commands.h"
#include "config/setting.h"
#include "tokens/token_file.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;
using bushd::client::detail_of;

// Somebody waits for it with a hand on the keyboard.
constexpr std::chrono::milliseconds kPatience{500};

std::set<std::string> tables(Client& client) {
  std::set<std::string> names;
  const auto reply = client.run(api::ListTables{}, Client::Until::kResult);
  const auto* list = detail_of<api::TableList>(reply);
  if (list == nullptr) return names;
  for (const api::TableEntry& entry : list->entries) names.insert(entry.name);
  return names;
}

std::set<std::string> programs(Client& client) {
  std::set<std::string> names;
  const auto reply = client.run(api::ListPrograms{}, Client::Until::kResult);
  const auto* list = detail_of<api::ProgramList>(reply);
  if (list == nullptr) return names;
  for (const api::ProgramEntry& entry : list->programs) names.insert(entry.program);
  names.erase("");  // of an MCU without one
  return names;
}

// Nothing where no daemon answers.
std::set<std::string> known_names(const Connection& connection, const std::string& value) {
  std::set<std::string> names;
  static const std::set<std::string> kOfDaemon{"NAME", "GROUP", "TABLE", "PROGRAM"};
  if (!kOfDaemon.contains(value)) return names;
  auto options = connection.options();
  options.answer_within = kPatience;
  const auto client = Client::open(std::move(options));
  if (!client) return names;
  if (value == "TABLE") return tables(**client);
  if (value == "PROGRAM") return programs(**client);
  const auto status = (*client)->status(kPatience);
  if (!status) return names;
  for (const auto& mcu : status->descriptions) {
    for (const api::MotorDescription& motor : mcu.snapshot.motors) {
      if (value == "NAME") names.insert(motor.name);
      if (value == "GROUP" && mcu.snapshot.is_mcu()) names.insert(motor.group);
    }
  }
  return names;
}

// Behind the motor of `config` its keys follow.
bool wants_keys(const std::vector<std::string>& words) {
  const auto config = std::ranges::find(words, "config");
  if (config == words.end() || words.back().starts_with('-')) return false;
  return std::any_of(config + 1, words.end() - 1,
                     [](const std::string& word) { return !word.starts_with('-'); });
}

std::set<std::string> keys() {
  std::set<std::string> names;
  for (const auto key : bushd::config::kSettingKeys) {
    names.insert(std::string(bushd::config::name_of(key)) + "=");
  }
  return names;
}

// Names of tokens stand behind --revoke alone: that of a new one is its maker's.
bool is_about_tokens(const std::vector<std::string>& words) {
  return std::find(words.begin(), words.end() - 1, "web-token") != words.end() - 1;
}

std::set<std::string> token_names(const bushd::Completion& completion) {
  std::set<std::string> names;
  const auto file = completion.given.find("--file");
  const auto found =
      bushd::tokens::read(web_token_file(file == completion.given.end() ? "" : file->second));
  if (completion.value != "TEXT" || !found) return names;
  for (const bushd::tokens::Token& token : *found) names.insert(token.name);
  return names;
}

}  // namespace

int complete(CommandLine& commands, const std::vector<std::string>& words) {
  bushd::Completion completion = commands.complete(words);
  std::set<std::string> names;
  if (is_about_tokens(words)) {
    names = token_names(completion);
  } else {
    names = wants_keys(words) ? keys() : known_names(commands.connection(), completion.value);
    completion.value.clear();
  }
  bushd::print_completion(completion, words.back(), {names.begin(), names.end()});
  return kDone;
}

}  // namespace bushctl
