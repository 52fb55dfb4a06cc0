// Reads one TOML table by a schema: required keys, exact types, ranges, nothing unknown. Every
// refusal names file, line, key, what stands there and what is allowed.
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace bushd::tables {

class TomlReader {
 public:
  // `table` must outlive the reader. `place` is the dotted path of the table ("motor[3]"; root:
  // empty).
  TomlReader(const toml::table& table, std::string file, std::string place = {});

  bool has(std::string_view key) const { return table_->contains(key); }
  bool is_string(std::string_view key) const { return (*table_)[key].is_string(); }
  bool is_array(std::string_view key) const { return (*table_)[key].is_array(); }
  // The sub-table under `key`, or null.
  const toml::table* table(std::string_view key) const { return (*table_)[key].as_table(); }

  // Refuses any other key.
  Result<void> only(std::initializer_list<std::string_view> keys) const;

  // Each refuses a missing key; `allowed` ends the sentence "allowed: ...".
  Result<std::string> string(std::string_view key, std::string_view allowed) const;
  Result<std::int64_t> integer(std::string_view key, std::int64_t lowest, std::int64_t highest,
                               std::string_view unit = {}) const;
  // A finite number, whole or not.
  Result<double> number(std::string_view key, std::string_view allowed) const;
  Result<bool> boolean(std::string_view key) const;
  Result<TomlReader> section(std::string_view key, std::string_view allowed) const;
  Result<const toml::array*> array(std::string_view key, std::string_view allowed) const;

  // The same for an element of an array under `key`.
  Result<std::int64_t> integer(std::string_view key, std::size_t index, const toml::node& node,
                               std::int64_t lowest, std::int64_t highest,
                               std::string_view unit = {}) const;
  Result<double> number(std::string_view key, std::size_t index, const toml::node& node,
                        std::string_view allowed) const;

  // An error at `key` (empty: at the table itself), or at one element of it.
  Error error(std::string_view key, std::string message) const;
  Error error(std::string_view key, std::optional<std::size_t> index, std::string message) const;

 private:
  Result<const toml::node*> required(std::string_view key, std::string_view allowed) const;
  std::string full(std::string_view key) const;

  const toml::table* table_;
  std::string file_;
  std::string place_;
};

// What stands there, for a message: `the string "a"`, `1.5`, `an array`.
std::string describe(const toml::node& node);

}  // namespace bushd::tables
