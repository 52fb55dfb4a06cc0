#include "tables/toml_keys.h"

#include <fmt/format.h>

#include <algorithm>

namespace bushd::tables {

tl::unexpected<Error> refuse(const TomlReader& reader, std::string_view key, std::string_view value,
                             std::string_view allowed) {
  return fail(reader.error(key, fmt::format("is \"{}\"; allowed: {}", value, allowed)));
}

Result<int> read_word(const TomlReader& reader, std::string_view key,
                      std::span<const std::string_view> words) {
  std::string rule;
  for (const std::string_view& word : words) {
    const bool last = &word == &words.back();
    rule += fmt::format("{}\"{}\"", rule.empty() ? "" : last ? " or " : ", ", word);
  }
  const auto word = reader.string(key, rule);
  if (!word) return fail(word.error());
  const auto found = std::find(words.begin(), words.end(), *word);
  if (found == words.end()) return refuse(reader, key, *word, rule);
  return static_cast<int>(found - words.begin());
}

Result<std::vector<TomlReader>> read_elements(const TomlReader& parent, const std::string& file,
                                              std::string_view key, const std::string& place) {
  const std::string allowed = fmt::format("sections [[{}]]", place);
  const auto elements = parent.array(key, allowed);
  if (!elements) return fail(elements.error());
  std::vector<TomlReader> readers;
  for (const toml::node& node : **elements) {
    const toml::table* table = node.as_table();
    if (table == nullptr) {
      return fail(parent.error(key, readers.size(),
                               fmt::format("is {}; allowed: {}", describe(node), allowed)));
    }
    readers.emplace_back(*table, file, fmt::format("{}[{}]", place, readers.size()));
  }
  return readers;
}

}  // namespace bushd::tables
