#include "config/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace bushd::config {

tl::unexpected<Error> refuse(const tables::TomlReader& reader, std::string_view key,
                             std::string_view value, std::string_view allowed) {
  return fail(reader.error(key, fmt::format("is \"{}\"; allowed: {}", value, allowed)));
}

Result<int> read_word(const tables::TomlReader& reader, std::string_view key,
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

}  // namespace bushd::config
