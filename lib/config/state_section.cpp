#include "config/state_section.h"

#include <string_view>
#include <utility>

#include "config/words.h"

namespace bushd::config {

Result<void> read_state(const tables::TomlReader& root, Config* config) {
  if (!root.has("state")) return {};
  const toml::table* section = root.table("state");
  if (section == nullptr) {
    return fail(root.error("state", "is not a section; allowed: one [state]"));
  }
  const tables::TomlReader reader(*section, config->path, "state");
  if (auto known = reader.only({"path", "required"}); !known) return known;
  if (reader.has("path")) {
    constexpr std::string_view kPathRule = "an absolute path of a folder, or \"\" to keep nothing";
    auto path = reader.string("path", kPathRule);
    if (!path) return fail(path.error());
    if (!path->empty() && !path->starts_with('/')) return refuse(reader, "path", *path, kPathRule);
    config->state.path = std::move(*path);
  }
  if (!reader.has("required")) return {};
  const auto required = reader.boolean("required");
  if (!required) return fail(required.error());
  config->state.required = *required;
  return {};
}

Result<void> read_restored(const tables::TomlReader& reader, Motor* motor) {
  if (!reader.has("restored")) return {};
  const auto word = read_word(reader, "restored", {"allow", "refuse"});
  if (!word) return fail(word.error());
  motor->restored_refused = *word == 1;
  return {};
}

}  // namespace bushd::config
