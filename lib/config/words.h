// Keys whose value is a name, or one of a few words.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "base/result.h"
#include "tables/toml_reader.h"

namespace bushd::config {

// Names of buses, groups, motors: on a command line what begins with - is an option, or a number of
// steps.
constexpr std::size_t kLongestName = 63;
constexpr std::string_view kNameRule = "1..63 characters of A-Z a-z 0-9 _ . -, the first one no -";
bool is_name(std::string_view text, std::size_t longest);

// "Theta" and "theta" are two motors to a program, and one to people.
std::string lower_case(std::string text);

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
