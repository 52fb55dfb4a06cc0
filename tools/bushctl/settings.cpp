#include "settings.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "base/fields_json.h"
#include "base/json_text.h"
#include "base/printable.h"
#include "config/edit.h"
#include "grid.h"
#include "tables/store/atomic_file.h"
#include "tables/toml_file.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
namespace config = bushd::config;
using bushd::fail;
using bushd::Result;

// A value of a key that a newer daemon has is a text.
nlohmann::json parsed(const std::string& key, const std::string& value) {
  const auto known = config::setting_key_of(key);
  if (known && is_word(*known)) return value;
  if (value == "none") return nullptr;
  nlohmann::json json = nlohmann::json::parse(value, nullptr, false);
  return json.is_discarded() ? nlohmann::json(value) : json;
}

}  // namespace

Result<api::Configure> parse_settings(const std::vector<std::string>& words) {
  api::Configure configure;
  if (words.empty()) return configure;
  const std::string& motor = words.front();
  if (motor.find('=') != std::string::npos) {
    return fail("\"" + motor + "\" stands where a motor's name is needed: config NAME KEY=VALUE");
  }
  if (words.size() == 1) {
    configure.motors = {motor};
    return configure;
  }
  configure.kind = api::Configure::Kind::kChange;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::size_t equals = words[i].find('=');
    if (equals == std::string::npos || equals == 0) {
      return fail("\"" + words[i] + "\" is no KEY=VALUE, such as offset=12.5");
    }
    configure.changes.push_back({motor, words[i].substr(0, equals), words[i].substr(equals + 1)});
  }
  return configure;
}

api::Configuration differences(api::Configuration configuration) {
  std::erase_if(configuration.settings,
                [](const api::MotorSetting& setting) { return setting.value == setting.in_file; });
  return configuration;
}

std::vector<std::string> table(const api::Configuration& configuration) {
  using enum Align;
  Grid grid({kLeft, kLeft, kLeft, kLeft});
  grid.row({"MOTOR", "KEY", "NOW", "IN bushd.toml"});
  for (const auto& [motor, key, value, in_file] : configuration.settings) {
    grid.row({bushd::printable(motor), bushd::printable(key), bushd::printable(value),
              bushd::printable(in_file)});
  }
  return grid.lines();
}

std::string json(const api::Configuration& configuration) {
  nlohmann::ordered_json out = bushd::json_of(configuration);
  for (auto& setting : out["settings"]) {
    for (const char* value : {"value", "value_in_file"}) {
      setting[value] = parsed(setting["key"], setting[value]);
    }
  }
  return bushd::json_text(out);
}

Result<api::Configure> save(const api::Configuration& configuration) {
  const std::string& path = configuration.path;
  const auto text = bushd::tables::read_text(path);
  if (!text) {
    return fail(text.error().text() + "; save it on the PC of bushd, as a user who may write it");
  }
  if (bushd::tables::text_sha256(*text) != configuration.sha256) {
    return fail(
        path +
        ": is not as bushd has read it; restart bushd, so that it counts, and save then what "
        "still differs");
  }
  api::Configure saved{.kind = api::Configure::Kind::kSaved};
  std::vector<config::Edit> edits;
  for (const auto& [motor, word, value, in_file] : configuration.settings) {
    const auto key = config::setting_key_of(word);
    if (!key) return fail("this bushctl does not know \"" + word + "\"; use that of the daemon");
    edits.push_back({.motor = motor, .key = *key, .value = value});
    saved.changes.push_back({motor, word, value});
  }
  const auto changed = config::edited(*text, edits, path);
  if (!changed) return fail(changed.error());
  if (const auto written = bushd::tables::store::replace_file(path, *changed); !written) {
    return fail(written.error());
  }
  saved.file_sha256 = bushd::tables::text_sha256(*changed);
  return saved;
}

}  // namespace bushctl
