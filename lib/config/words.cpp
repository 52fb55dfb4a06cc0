#include "config/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>

namespace bushd::config {

bool is_name(std::string_view text, std::size_t longest) {
  return !text.empty() && text.size() <= longest && text.front() != '-' &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
                  c == '_' || c == '.' || c == '-';
         });
}

std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

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
