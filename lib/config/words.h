// Keys whose value is one of a few words.
#pragma once

#include <initializer_list>
#include <span>
#include <string_view>

#include "base/result.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// "is X; allowed: A" for a value of the right type.
tl::unexpected<Error> refuse(const tables::TomlReader& reader, std::string_view key,
                             std::string_view value, std::string_view allowed);

// Which of the words stands there, counted from 0.
Result<int> read_word(const tables::TomlReader& reader, std::string_view key,
                      std::span<const std::string_view> words);
inline Result<int> read_word(const tables::TomlReader& reader, std::string_view key,
                             std::initializer_list<std::string_view> words) {
  return read_word(reader, key, std::span(words.begin(), words.end()));
}

}  // namespace bushd::config
