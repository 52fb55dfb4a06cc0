// Names, and how keys are read.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "tables/toml_keys.h"

namespace bushd::config {

// Names of buses, groups, motors: on a command line what begins with - is an option, or a number of
// steps.
constexpr std::size_t kLongestName = 63;
constexpr std::string_view kNameRule = "1..63 characters of A-Z a-z 0-9 _ . -, the first one no -";
bool is_name(std::string_view text, std::size_t longest);

// "Theta" and "theta" are two motors to a program, and one to people.
std::string lower_case(std::string text);

using tables::Keys;
using tables::read_word;
using tables::refuse;

}  // namespace bushd::config
